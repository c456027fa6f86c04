#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <span>

#include "compress/format/voxels/voxel_set.h"

namespace packtrace {

/// What the lines of matching_depth() are tested against, in voxel units.
struct LineScene {
  VoxelIndex size{}; ///< of the grid
  std::span<const std::array<DVec3, 3>> triangles;
  /// Whether a triangle is there at a point of it.
  std::function<bool(size_t triangle, DVec3 point)> opaque;
  /// How early a voxel is chosen: the least first. Infinity: never; minus infinity: always.
  std::function<float(VoxelIndex)> depth;
};

/// The depth up to which voxels must be chosen so that they meet as many of many parallel lines in several directions
/// as the triangles do. By Cauchy's formula, lines spread evenly measure what a body hides from its surroundings,
/// averaged over directions. The result is the same for equal input.
float matching_depth(const LineScene& scene);

} // namespace packtrace
