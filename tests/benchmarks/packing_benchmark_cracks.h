#pragma once

#include <cstdint>

#include "compress/bake/bake_config.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// Counts equal source positions that differ after packing. Positions are the world shapes' positions in double.
struct CrackCounts {
  uint64_t triangles = 0;               ///< triangles of the counted shapes
  uint64_t instanced_shapes = 0;        ///< stored once for several placements, on their own grids; not counted
  uint64_t shared_between_clusters = 0; ///< decoded positions used by several clusters
  uint64_t shared_between_meshes = 0;   ///< source positions used by several shapes
  uint64_t collapsed_triangles = 0;     ///< source triangles without area on the grid; the file leaves them out
  uint64_t coinciding_triangles = 0;    ///< source triangles that are decoded less often than they occur on the grid
  uint64_t lost_triangles = 0; ///< other source triangles that are not decoded where their corners' grid positions are
  uint64_t cracked_between_clusters = 0; ///< upper bound: source positions of lost triangles
  uint64_t cracked_between_meshes = 0;   ///< upper bound: those of them that several shapes use
  /// For comparison: the number of shared_between_meshes that would differ if each shape had a 16-bit box of its own.
  uint64_t own_box_cracked_between_meshes = 0;
};

/// Bakes the scene and computes, for each source position, the decoded position that docs/baked_format.md assigns to
/// it. Then looks for each source triangle with area among the decoded triangles with these corners.
CrackCounts count_cracks(const Scene& scene, const BakeConfig& config);

} // namespace packtrace
