#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <span>

#include "compress/format/voxels/voxel_set.h"

namespace packtrace {

/// Input of matching_depth(), in voxel units.
struct LineScene {
  VoxelIndex size{}; ///< of the grid
  std::span<const std::array<DVec3, 3>> triangles;
  /// Whether a triangle is opaque at one of its points.
  std::function<bool(size_t triangle, DVec3 point)> opaque;
  /// Order in which voxels are selected, smallest first. Infinity: never; minus infinity: always.
  std::function<float(VoxelIndex)> depth;
};

/// Returns the depth up to which voxels must be selected to block the same number of lines as the triangles. The lines
/// are parallel and evenly spaced in each of several directions. By Cauchy's formula, the number of blocked lines
/// measures the mean projected area. Deterministic.
float matching_depth(const LineScene& scene);

} // namespace packtrace
