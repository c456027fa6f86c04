#pragma once

#include <cstdint>

namespace packtrace {

/// Which voxels a triangle sets.
enum class VoxelRule : uint32_t {
  kConservative, ///< every closed voxel that it touches
  kSeparating,   ///< 6-separating: no path through faces of empty voxels crosses the surface
  kMatched, ///< some of those of kConservative and inside: as many as block the same number of lines as the triangles
};

} // namespace packtrace
