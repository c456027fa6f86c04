#pragma once

#include <cstdint>
#include <vector>

#include "compress/bake/clusters/geometry_clusters.h"
#include "compress/bake/clusters/quantized_geometry.h"
#include "compress/format/cluster/cluster_codec.h"
#include "compress/format/layout/baked_format.h"

namespace packtrace {

/// Clusters and bit streams of one geometry.
struct EncodedGeometry {
  /// Ordered by material class; payload offsets, first triangles and first vertices are set.
  std::vector<baked::ClusterRecord> clusters;
  std::vector<uint8_t> payload; ///< size is a multiple of 4 bytes; no read slack
  std::array<uint32_t, 8> class_clusters{};
  uint32_t triangle_count = 0, vertex_count = 0;
  std::vector<SourceVertex> sources; ///< by vertex, cluster after cluster; empty unless the geometry deforms
  Vec3 bounds_lo{}, bounds_hi{};     ///< of decoded positions; lo > hi if empty
  ClusterView::StreamBits stream_bits;
};

/// Encodes the clusters, decodes them again and compares. The bytes do not depend on the thread count.
/// Throws Error(kLimitExceeded) if the payload exceeds 16 GiB, or if a cluster does not decode to its input.
EncodedGeometry encode_geometry(const QuantizedGeometry& geometry, const GeometryClusters& clusters);

} // namespace packtrace
