#pragma once

#include <cstdint>

#include "compress/bake/bake_config.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// Where positions that are equal in a scene differ after packing; positions are those of the world's shapes in double.
struct CrackCounts {
  uint64_t triangles = 0;                ///< of the shapes looked at
  uint64_t instanced_shapes = 0;         ///< stored once for several places, on grids of their own: left out
  uint64_t shared_between_clusters = 0;  ///< decoded positions that several clusters hold
  uint64_t shared_between_meshes = 0;    ///< source positions that several shapes hold
  uint64_t lost_triangles = 0;           ///< of the source, not where one decoded position a source position puts them
  uint64_t cracked_between_clusters = 0; ///< at most: source positions that a lost triangle has
  uint64_t cracked_between_meshes = 0;   ///< at most: those of them that several shapes hold
  /// For comparison: of shared_between_meshes, those that differ if each shape has a 16-bit box of its own.
  uint64_t own_box_cracked_between_meshes = 0;
};

/// Bakes the scene, gives every distinct source position the one decoded position that docs/baked_format.md assigns to
/// it, and looks for each source triangle with these corners among the decoded ones, as often as it is there.
CrackCounts count_cracks(const Scene& scene, const BakeConfig& config);

} // namespace packtrace
