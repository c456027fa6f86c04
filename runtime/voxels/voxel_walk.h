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

  VoxelWalk(V3 origin, V3 direction) : origin_(origin), direction_(direction), inverse_(Real(1) / direction) {}

  /// Moves to the first voxel that the ray meets from t_min on; false if there is none.
  [[gnu::always_inline]] bool enter(const VoxelIndex& size, Real t_min, Real t_max) {
    for (size_t a = 0; a < 3; ++a) size_[a] = static_cast<int32_t>(size[a]);
    t_ = t_min, axis_ = -1;
    for (int a = 0; a < 3; ++a) {
      if (direction_[a] == Real(0)) {
        if (!(origin_[a] >= Real(0) && origin_[a] < Real(size_[at(a)]))) return false;
        continue;
      }
      const Real near = crossing(a, direction_[a] > Real(0) ? 0 : size_[at(a)]);
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
      int32_t v = clamp_to(std::floor(origin_[a] + t_ * direction_[a]), 0, last);
      if (direction_[a] > Real(0)) {
        if (crossed(a, last + 1)) return false;
        while (v < last && crossed(a, v + 1)) ++v;
        while (v > 0 && !crossed(a, v)) --v;
      } else if (direction_[a] < Real(0)) {
        if (crossed(a, 0)) return false;
        while (v > 0 && crossed(a, v)) --v;
        while (v < last && !crossed(a, v + 1)) ++v;
      }
      voxel_[at(a)] = v;
    }
    return true;
  }

  /// Leaves the cell of 2^shift voxels that holds the current one; false if the ray leaves the grid or ends.
  [[gnu::always_inline]] bool leave_cell(uint32_t shift, Real t_max) {
    std::array<int32_t, 3> low, plane;
    int exit = 0;
    Real t_exit = std::numeric_limits<Real>::infinity();
    for (int a = 0; a < 3; ++a) {
      low[at(a)] = voxel_[at(a)] >> shift << shift;
      if (direction_[a] == Real(0)) continue;
      plane[at(a)] = direction_[a] > Real(0) ? low[at(a)] + (1 << shift) : low[at(a)];
      if (const Real t = crossing(a, plane[at(a)]); t < t_exit) t_exit = t, exit = a;
    }
    if (!(t_exit < t_max)) return false;
    for (int a = 0; shift > 0 && a < 3; ++a) {
      if (a == exit || direction_[a] == Real(0)) continue;
      const bool up = direction_[a] > Real(0);
      const int32_t first = voxel_[at(a)], high = low[at(a)] + (1 << shift) - 1;
      const auto before_exit = [&](int32_t p) {
        const Real t = crossing(a, p);
        return t < t_exit || (t == t_exit && a < exit);
      };
      int32_t v = clamp_to(std::floor(origin_[a] + t_exit * direction_[a]), up ? first : low[at(a)], up ? high : first);
      if (up) {
        while (v < high && before_exit(v + 1)) ++v;
        while (v > first && !before_exit(v)) --v;
      } else {
        while (v > low[at(a)] && before_exit(v)) --v;
        while (v < first && !before_exit(v + 1)) ++v;
      }
      voxel_[at(a)] = v;
    }
    t_ = t_exit, axis_ = exit;
    voxel_[at(exit)] = direction_[exit] > Real(0) ? plane[at(exit)] : plane[at(exit)] - 1;
    return voxel_[at(exit)] >= 0 && voxel_[at(exit)] < size_[at(exit)];
  }

  Real t() const { return t_; }
  int axis() const { return axis_; }
  VoxelIndex voxel() const {
    return {static_cast<uint32_t>(voxel_[0]), static_cast<uint32_t>(voxel_[1]), static_cast<uint32_t>(voxel_[2])};
  }

private:
  static constexpr size_t at(int axis) { return static_cast<size_t>(axis); }
  [[gnu::always_inline]] Real crossing(int axis, int32_t plane) const {
    return (Real(plane) - origin_[axis]) * inverse_[axis];
  }
  /// A NaN becomes the lower end.
  static int32_t clamp_to(Real value, int32_t low, int32_t high) {
    return value >= Real(high) ? high : value > Real(low) ? static_cast<int32_t>(value) : low;
  }

  V3 origin_, direction_, inverse_;
  std::array<int32_t, 3> size_{}, voxel_{};
  Real t_ = 0;
  int axis_ = -1;
};

} // namespace packtrace
