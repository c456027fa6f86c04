#pragma once

#include <cstdint>
#include <vector>

#include "compress/bake/clusters/geometry_encoder.h"
#include "compress/bake/lod/cluster_lod.h"
#include "compress/format/layout/lod_format.h"

namespace packtrace {

/// Levels of detail of one geometry as they go into a file.
struct EncodedLod {
  struct Level {
    EncodedGeometry encoded; ///< empty at level 0: that is the geometry itself
    uint64_t triangles = 0;  ///< of the discrete level
    uint32_t group_count = 0;
    float error = 0.0f; ///< of the discrete level, object units
  };
  std::vector<Level> levels;                 ///< none, or two and more
  std::vector<baked::LodGroupRecord> groups; ///< level by level
  std::vector<baked::LodLinkRecord> links;   ///< level by level, cluster by cluster
};

/// Encodes levels on the geometry's own lattice. Errors and spheres are in object units and of what is decoded: they
/// count what positions lose as floats, but not what they lost against the source on their way to level 0. The
/// validator's rules hold: errors do not shrink and spheres hold those below, in float too. Empty where there is one
/// level only, or where a sphere or an error is beyond the range of floats.
/// @param geometry what `lod` was built of; its positions and vertices become the levels'
/// @param lod is used up
EncodedLod encode_lod(QuantizedGeometry& geometry, ClusterLod& lod);

} // namespace packtrace
