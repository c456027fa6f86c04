#pragma once

#include <array>
#include <cstddef>

#include "compress/format/voxels/proxy_codec.h"
#include "pbrt_import/scene/bounds.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

/// How far a proxy's voxels extend in the 26 directions of {-1, 0, 1}^3, for bounds of rotated instances that are
/// tighter than those of the grid's corners. Distance fields and grids of more than 256 voxels along an axis count as
/// full.
class ProxyReach {
public:
  explicit ProxyReach(const Proxy& proxy);

  /// Bounds of the voxels of an instance. Not empty.
  Bounds bounds(const DAffine& world_from_grid) const;

private:
  /// At least the largest dot product of a direction and a point of the voxels, grid units: the direction is a
  /// combination, with weights above 0, of three of the 26.
  double along(DVec3 direction) const;

  static size_t number(int x, int y, int z) { return static_cast<size_t>(9 * (z + 1) + 3 * (y + 1) + x + 1); }

  std::array<double, 27> reach_{};
};

} // namespace packtrace
