#pragma once

#include <cstdint>

namespace packtrace {

/// Which voxels a triangle sets.
enum class VoxelRule : uint32_t {
  kConservative, ///< every closed voxel that it touches
  kSeparating,   ///< 6-separating: no path through faces of empty voxels crosses the surface
  kMatched,      ///< those of kConservative and inside, but only as many as hide what the triangles hide
};

} // namespace packtrace
