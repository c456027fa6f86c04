#pragma once

#include <cstdint>
#include <vector>

#include "compress/bake/clusters/geometry_encoder.h"
#include "compress/bake/lod/cluster_lod.h"
#include "compress/format/layout/lod_format.h"

namespace packtrace {

/// The LOD levels of one geometry as written to a file.
struct EncodedLod {
  struct Level {
    EncodedGeometry encoded; ///< empty at level 0, which is the geometry itself
    uint64_t triangles = 0;  ///< in the discrete level
    uint32_t group_count = 0;
    float error = 0.0f;                                       ///< of the discrete level, in object units
    NormalEncoding normal_encoding = NormalEncoding::kAxis24; ///< from level 1 on
    /// Angles to the normals in the encoding of level 0, in degrees.
    float max_normal_error = 0.0f, mean_normal_error = 0.0f;
  };
  std::vector<Level> levels;                 ///< empty, or at least two
  std::vector<baked::LodGroupRecord> groups; ///< level by level
  std::vector<baked::LodLinkRecord> links;   ///< level by level, cluster by cluster
};

/// Encodes levels on the geometry's lattice. Errors and spheres are in object units, of the decoded surfaces: they
/// include the rounding of positions to float, but not the quantisation error of level 0. The validator's rules hold,
/// also in float: errors do not decrease, and spheres contain those of the groups below. Returns an empty result if
/// there is only one level, if a level has more than kMaxLodGroups groups, or if a sphere or an error exceeds the
/// range of float.
/// @param geometry the geometry that `lod` was built from; receives the levels' positions and vertices
/// @param lod is consumed
/// @param coarser_normals levels may have normals of fewer bits (level_normal_limit())
EncodedLod encode_lod(QuantizedGeometry& geometry, ClusterLod& lod, bool coarser_normals = true);

} // namespace packtrace
