#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include <glm/glm.hpp>

#include "compress/format/voxels/voxel_set.h"

namespace packtrace {

/// A ray's way through a grid of voxels, cell by cell, see VoxelTracer.
template <class Real>
class VoxelWalk {
public:
  using V3 = glm::vec<3, Real>;

  VoxelWalk(V3 origin, V3 direction) {
    for (int a = 0; a < 3; ++a)
      origin_[at(a)] = origin[a], direction_[at(a)] = direction[a], inverse_[at(a)] = Real(1) / direction[a];
  }

  /// Moves to the first voxel that the ray meets from t_min on; false if there is none.
  [[gnu::always_inline]] bool enter(const VoxelIndex& size, Real t_min, Real t_max) {
    for (size_t a = 0; a < 3; ++a) size_[a] = static_cast<int32_t>(size[a]);
    t_ = t_min, axis_ = -1;
    for (int a = 0; a < 3; ++a) {
      if (direction_[at(a)] == Real(0)) {
        if (!(origin_[at(a)] >= Real(0) && origin_[at(a)] < Real(size_[at(a)]))) return false;
        continue;
      }
      const Real near = crossing(a, direction_[at(a)] > Real(0) ? 0 : size_[at(a)]);
      if (near > t_min && near >= t_) t_ = near, axis_ = a;
    }
    if (!(t_ < t_max)) return false;
    // Everything up to the entry's (t, axis) is crossed, and all that t_min lies behind.
    const auto crossed = [&](int a, int32_t p) {
      const Real t = crossing(a, p);
      return t < t_ || (t == t_ && (axis_ < 0 || a <= axis_));
    };
    for (int a = 0; a < 3; ++a) {
      const int32_t last = size_[at(a)] - 1;
      const bool up = direction_[at(a)] > Real(0), still = direction_[at(a)] == Real(0);
      if (!still && crossed(a, up ? last + 1 : 0)) return false;
      int32_t v = clamp_to(origin_[at(a)] + t_ * direction_[at(a)], 0, last);
      if (!still)
        v = up ? last_crossed(v, 0, last, [&](int32_t p) { return crossed(a, p); })
               : first_uncrossed(v, 0, last, [&](int32_t p) { return crossed(a, p); });
      voxel_[at(a)] = v;
      step_[at(a)] = still ? 0 : up ? 1 : -1;
      next_[at(a)] = leaving(a);
    }
    return true;
  }

  /// Leaves the cell of 2^shift voxels that holds the current one; false if the ray leaves the grid or ends.
  [[gnu::always_inline]] bool leave_cell(uint32_t shift, Real t_max) {
    if (shift > kSteppedShift) return leave_large_cell(shift, t_max);
    const std::array<int32_t, 3> from = voxel_;
    do
      if (!leave_voxel(t_max)) return false;
    while (((voxel_[0] ^ from[0]) | (voxel_[1] ^ from[1]) | (voxel_[2] ^ from[2])) >> shift == 0);
    return true;
  }

  Real t() const { return t_; }
  int axis() const { return axis_; }
  VoxelIndex voxel() const {
    return {static_cast<uint32_t>(voxel_[0]), static_cast<uint32_t>(voxel_[1]), static_cast<uint32_t>(voxel_[2])};
  }

private:
  static constexpr uint32_t kSteppedShift =
      1; ///< of cells that are left voxel by voxel, which is faster for small ones

  static constexpr size_t at(int axis) { return static_cast<size_t>(axis); }
  [[gnu::always_inline]] Real crossing(int axis, int32_t plane) const {
    return (Real(plane) - origin_[at(axis)]) * inverse_[at(axis)];
  }
  /// Where the ray leaves the current voxel along an axis; infinite if it does not.
  [[gnu::always_inline]] Real leaving(int axis) const {
    constexpr Real kNever = std::numeric_limits<Real>::infinity();
    if (step_[at(axis)] == 0) return kNever;
    const Real t = crossing(axis, voxel_[at(axis)] + (step_[at(axis)] > 0 ? 1 : 0));
    return t < kNever ? t : kNever; // also for a NaN
  }

  /// Of equal t the lower axis.
  static int first_axis(const std::array<Real, 3>& t) {
    return t[0] <= t[1] ? (t[0] <= t[2] ? 0 : 2) : (t[1] <= t[2] ? 1 : 2);
  }

  /// Along a rising axis: the last of the planes low..high that is crossed, or low.
  template <class Crossed>
  [[gnu::always_inline]] static int32_t last_crossed(int32_t guess, int32_t low, int32_t high, const Crossed& crossed) {
    while (guess < high && crossed(guess + 1)) ++guess;
    while (guess > low && !crossed(guess)) --guess;
    return guess;
  }
  /// Along a falling axis: the voxel of low..high above the first plane that is not crossed.
  template <class Crossed>
  [[gnu::always_inline]] static int32_t first_uncrossed(int32_t guess, int32_t low, int32_t high,
                                                        const Crossed& crossed) {
    while (guess > low && crossed(guess)) --guess;
    while (guess < high && !crossed(guess + 1)) ++guess;
    return guess;
  }

  [[gnu::always_inline]] bool leave_voxel(Real t_max) {
    const int exit = first_axis(next_);
    if (!(next_[at(exit)] < t_max)) return false;
    return cross(exit, next_[at(exit)], voxel_[at(exit)] + step_[at(exit)]);
  }

  [[gnu::always_inline]] bool leave_large_cell(uint32_t shift, Real t_max) {
    constexpr Real kNever = std::numeric_limits<Real>::infinity();
    std::array<int32_t, 3> low;
    std::array<Real, 3> t_plane;
    for (int a = 0; a < 3; ++a) {
      low[at(a)] = voxel_[at(a)] >> shift << shift;
      const Real t = crossing(a, low[at(a)] + (step_[at(a)] > 0 ? 1 << shift : 0));
      t_plane[at(a)] = step_[at(a)] != 0 && t < kNever ? t : kNever;
    }
    const int exit = first_axis(t_plane);
    const Real t_exit = t_plane[at(exit)];
    if (!(t_exit < t_max)) return false;
    for (int a = 0; a < 3; ++a) {
      if (a == exit || step_[at(a)] == 0) continue;
      const int32_t first = voxel_[at(a)], high = low[at(a)] + (1 << shift) - 1;
      const auto before_exit = [&](int32_t p) {
        const Real t = crossing(a, p);
        return t < t_exit || (t == t_exit && a < exit);
      };
      const Real position = origin_[at(a)] + t_exit * direction_[at(a)];
      voxel_[at(a)] = step_[at(a)] > 0
                          ? last_crossed(clamp_to(position, first, high), first, high, before_exit)
                          : first_uncrossed(clamp_to(position, low[at(a)], first), low[at(a)], first, before_exit);
      next_[at(a)] = leaving(a);
    }
    return cross(exit, t_exit, step_[at(exit)] > 0 ? low[at(exit)] + (1 << shift) : low[at(exit)] - 1);
  }

  /// Enters a voxel through a plane; false if the grid ends there.
  [[gnu::always_inline]] bool cross(int axis, Real t, int32_t voxel) {
    t_ = t, axis_ = axis, voxel_[at(axis)] = voxel;
    next_[at(axis)] = leaving(axis);
    return static_cast<uint32_t>(voxel) < static_cast<uint32_t>(size_[at(axis)]);
  }

  /// Rounds down; a NaN becomes the lower end.
  static int32_t clamp_to(Real value, int32_t low, int32_t high) {
    return value >= Real(high) ? high : value > Real(low) ? static_cast<int32_t>(value) : low;
  }

  std::array<Real, 3> origin_, direction_, inverse_; // not vec: its [] is a branch
  std::array<int32_t, 3> size_{}, voxel_{}, step_{};
  std::array<Real, 3> next_{}; ///< where the ray leaves the voxel along each axis
  Real t_ = 0;
  int axis_ = -1;
};

} // namespace packtrace
