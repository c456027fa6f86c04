#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <glm/glm.hpp>

#include "compress/format/voxels/voxel_set.h"

namespace packtrace {

/// A ray's way through a grid of voxels, cell by cell, see VoxelTracer. The three axes are lanes of one vector, so that
/// a step has no branches but those that end it; the fourth lane stands still.
template <class Real>
class VoxelWalk {
public:
  using V3 = glm::vec<3, Real>;

  VoxelWalk(V3 origin, V3 direction) {
    for (int a = 0; a < 3; ++a)
      origin_[a] = origin[a], direction_[a] = direction[a], inverse_[a] = Real(1) / direction[a];
  }

  /// Moves to the first voxel that the ray meets from t_min on; false if there is none.
  [[gnu::always_inline]] bool enter(const VoxelIndex& size, Real t_min, Real t_max) {
    t_ = t_min;
    int axis = -1;
    for (int a = 0; a < 3; ++a) {
      size_[a] = static_cast<int32_t>(size[at(a)]);
      if (direction_[a] == Real(0)) {
        if (!(origin_[a] >= Real(0) && origin_[a] < Real(size_[a]))) return false;
        continue;
      }
      const Real near = crossing(a, direction_[a] > Real(0) ? 0 : size_[a]);
      if (near > t_min && near >= t_) t_ = near, axis = a;
    }
    if (!(t_ < t_max)) return false;
    // Everything up to the entry's (t, axis) is crossed, and all that t_min lies behind.
    const auto crossed = [&](int a, int32_t p) {
      const Real t = crossing(a, p);
      return t < t_ || (t == t_ && (axis < 0 || a <= axis));
    };
    for (int a = 0; a < 3; ++a) {
      exit_[a] = a == axis ? MaskInt(-1) : MaskInt(0);
      const int32_t last = size_[a] - 1;
      if (direction_[a] == Real(0)) {
        voxel_[a] = clamp_to(origin_[a], 0, last);
        stand_still(a);
        continue;
      }
      const bool up = direction_[a] > Real(0);
      if (crossed(a, up ? last + 1 : 0)) return false;
      voxel_[a] = settle(up, clamp_to(origin_[a] + t_ * direction_[a], 0, last), 0, last,
                         [&](int32_t p) { return crossed(a, p); });
      step_[a] = up ? 1 : -1, plane_step_[a] = up ? Real(1) : Real(-1);
      plane_[a] = Real(voxel_[a] + (up ? 1 : 0));
    }
    stand_still(3);
    find_crossings(plane_, next_);
    return true;
  }

  /// Leaves the cell of 2^shift voxels that holds the current one; false if the ray leaves the grid or ends.
  [[gnu::always_inline]] bool leave_cell(uint32_t shift, Real t_max) {
    if (shift > kSteppedShift) return leave_large_cell(shift, t_max) && in_grid();
    const Ints from = voxel_;
    do
      if (!advance(t_max)) return false;
    while (stays(from, shift));
    return in_grid();
  }

  Real t() const { return t_; }
  /// Axis of the face through which the ray entered the voxel; -1 if it began inside.
  int axis() const { return exit_[0] != 0 ? 0 : exit_[1] != 0 ? 1 : exit_[2] != 0 ? 2 : -1; }
  VoxelIndex voxel() const {
    return {static_cast<uint32_t>(voxel_[0]), static_cast<uint32_t>(voxel_[1]), static_cast<uint32_t>(voxel_[2])};
  }

private:
  using Ints [[gnu::vector_size(16)]] = int32_t;
  using Reals [[gnu::vector_size(4 * sizeof(Real))]] = Real;
  using MaskInt = std::conditional_t<sizeof(Real) == 4, int32_t, int64_t>;
  using Masks [[gnu::vector_size(4 * sizeof(Real))]] = MaskInt; // the type of comparisons of Reals

  // Cells of at most 2^kSteppedShift voxels along each axis are left voxel by voxel, which is faster.
  static constexpr uint32_t kSteppedShift = 1;
  static constexpr Real kNever = std::numeric_limits<Real>::infinity();

  static constexpr size_t at(int axis) { return static_cast<size_t>(axis); }
  [[gnu::always_inline]] Real crossing(int axis, int32_t plane) const {
    return (Real(plane) - origin_[axis]) * inverse_[axis];
  }
  /// Excludes a lane from choose_exit(): its planes have infinite t, or NaN for plane 0.
  [[gnu::always_inline]] void stand_still(int lane) {
    origin_[lane] = direction_[lane] = 0, inverse_[lane] = kNever, plane_[lane] = 0;
  }

  /// The t at which the ray crosses one plane per axis; infinite if it does not, and in place of NaN.
  [[gnu::always_inline]] void find_crossings(const Reals& planes, Reals& t) const {
    const Reals found = (planes - origin_) * inverse_, never = Reals{} + kNever;
    t = found < never ? found : never;
  }

  /// Chooses the lane with the smallest t, of equal ones that of the lowest axis, and sets t_ to its t.
  [[gnu::always_inline]] void choose_exit(const Reals& t) {
    constexpr Masks kLower1{-1, -1, 0, 0}, kLower2{-1, 0, 0, 0}; // lanes that win against an equal shuffled t
    const Reals t1 = __builtin_shufflevector(t, t, 1, 2, 0, 3), t2 = __builtin_shufflevector(t, t, 2, 0, 1, 3);
    exit_ = ((t < t1) | ((t <= t1) & kLower1)) & ((t < t2) | ((t <= t2) & kLower2));
    const Reals least = t1 < t2 ? t1 : t2;
    t_ = (t < least ? t : least)[0];
  }

  /// Enters the next voxel, which may lie outside the grid; false if the ray ends before.
  [[gnu::always_inline]] bool advance(Real t_max) {
    choose_exit(next_);
    if (!(t_ < t_max)) return false;
    voxel_ += step_ & __builtin_convertvector(exit_, Ints);
    plane_ += reinterpret_cast<Reals>(reinterpret_cast<Masks>(plane_step_) & exit_);
    find_crossings(plane_, next_);
    return true;
  }

  [[gnu::always_inline]] bool stays(const Ints& from, uint32_t shift) const {
    const Ints changed = voxel_ ^ from;
    return (changed[0] | changed[1] | changed[2]) >> shift == 0;
  }
  [[gnu::always_inline]] bool in_grid() const {
    const Ints out = (voxel_ < 0) | (voxel_ >= size_);
    return (out[0] | out[1] | out[2]) == 0;
  }

  /// Corrects a guessed voxel along an axis, within low..high: the ray has crossed the plane behind the result, but not
  /// the one ahead.
  template <class Crossed>
  [[gnu::always_inline]] static int32_t settle(bool up, int32_t guess, int32_t low, int32_t high,
                                               const Crossed& crossed) {
    if (up) {
      while (guess < high && crossed(guess + 1)) ++guess;
      while (guess > low && !crossed(guess)) --guess;
    } else {
      while (guess > low && crossed(guess)) --guess;
      while (guess < high && !crossed(guess + 1)) ++guess;
    }
    return guess;
  }

  [[gnu::always_inline]] bool leave_large_cell(uint32_t shift, Real t_max) {
    const int32_t size = 1 << shift;
    const Ints low = voxel_ & -size, rising = step_ > 0;
    Reals t;
    find_crossings(__builtin_convertvector(low + (size & rising), Reals), t);
    choose_exit(t);
    if (!(t_ < t_max)) return false;
    // The voxel along the other axes is guessed from the position at t_. The guess is right if the ray has crossed the
    // plane behind it, but not the one ahead.
    const Ints first = rising ? voxel_ : low, last = rising ? low + (size - 1) : voxel_;
    const Reals from = __builtin_convertvector(first, Reals), to = __builtin_convertvector(last, Reals);
    Reals position = origin_ + t_ * direction_;
    position = position > from ? position : from;
    position = position < to ? position : to;
    const Ints guess = __builtin_convertvector(position, Ints);
    const Reals t_ahead = (__builtin_convertvector(guess + (rising & 1), Reals) - origin_) * inverse_,
                t_behind = (__builtin_convertvector(guess + (~rising & 1), Reals) - origin_) * inverse_,
                t_exit = Reals{} + t_;
    const Masks lower = exit_[0] != 0 ? Masks{} : exit_[1] != 0 ? Masks{-1, 0, 0, 0} : Masks{-1, -1, 0, 0};
    const Masks crossed_ahead = (t_ahead < t_exit) | ((t_ahead == t_exit) & lower),
                crossed_behind = (t_behind < t_exit) | ((t_behind == t_exit) & lower);
    const Ints exit = __builtin_convertvector(exit_, Ints), others = (step_ != 0) & ~exit,
               wrong = others & __builtin_convertvector(crossed_ahead | ~crossed_behind, Ints);
    voxel_ = exit ? (rising ? low + size : low - 1) : others ? guess : voxel_;
    if ((wrong[0] | wrong[1] | wrong[2]) != 0) settle_lanes(first, last, others, lower);
    plane_ = __builtin_convertvector(voxel_ + (rising & 1), Reals);
    find_crossings(plane_, next_);
    return true;
  }

  /// Corrects the guessed voxels of the lanes in `others`, within low..high.
  [[gnu::noinline]] void settle_lanes(const Ints& low, const Ints& high, const Ints& others, const Masks& lower) {
    for (int a = 0; a < 3; ++a)
      if (others[a] != 0)
        voxel_[a] = settle(step_[a] > 0, voxel_[a], low[a], high[a], [&](int32_t p) {
          const Real t = crossing(a, p);
          return t < t_ || (t == t_ && lower[a] != 0);
        });
  }

  /// Rounds down; a NaN becomes the lower end.
  static int32_t clamp_to(Real value, int32_t low, int32_t high) {
    return value >= Real(high) ? high : value > Real(low) ? static_cast<int32_t>(value) : low;
  }

  Reals origin_{}, direction_{}, inverse_{};
  Reals plane_{}, plane_step_{}; // the plane ahead along each axis; how it moves in a step: 1, -1 or 0
  Reals next_{};                 // t of those planes
  Ints size_{}, voxel_{}, step_{};
  Masks exit_{}; // all bits set in the lane whose plane was crossed last
  Real t_ = 0;
};

} // namespace packtrace
