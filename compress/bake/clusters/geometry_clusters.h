#pragma once

#include <cstdint>
#include <vector>

#include "compress/bake/clusters/quantized_geometry.h"
#include "compress/bake/clusters/repeated_clusters.h"

namespace packtrace {

/// A run of triangles of one kind.
struct ClusterRange {
  uint32_t first_triangle = 0, triangle_count = 0; ///< range in GeometryClusters::triangles
  uint32_t kind = 0;                               ///< index into QuantizedGeometry::kinds
  uint32_t ordered = 0; ///< 1: strips keep the order of the triangles (RegularBlock, RepeatedPart); else 0
};

/// The triangles of a geometry, cluster by cluster.
struct GeometryClusters {
  std::vector<Triangle> triangles; ///< indices into QuantizedGeometry::vertices
  std::vector<ClusterRange> clusters;
};

/// Splits a geometry into clusters of at most 128 triangles and 256 vertices, ordered by material slot, kind and
/// position. The result depends on the input only, not on the thread count.
GeometryClusters split_geometry(const QuantizedGeometry& geometry, RepeatedClusters repeated);

} // namespace packtrace
