#pragma once

#include <cstdint>
#include <vector>

#include "compress/bake/clusters/geometry_clusters.h"
#include "compress/bake/clusters/quantized_geometry.h"
#include "compress/format/layout/baked_format.h"
#include "compress/format/cluster/cluster_codec.h"

namespace packtrace {

/// Clusters and bit streams of one geometry.
struct EncodedGeometry {
  std::vector<baked::ClusterRecord> clusters; ///< ordered by material class; offsets and firsts are set
  std::vector<uint8_t> payload;               ///< multiple of 4 bytes, no slack
  std::array<uint32_t, 8> class_clusters{};
  uint32_t triangle_count = 0, vertex_count = 0;
  Vec3 bounds_lo{}, bounds_hi{}; ///< decoded; lo > hi where empty
  ClusterView::StreamBits stream_bits;
};

/// Encodes the clusters and checks by decoding that nothing changed. Bytes do not depend on the thread count.
/// Throws Error(kLimitExceeded) where the payload exceeds 16 GiB.
EncodedGeometry encode_geometry(const QuantizedGeometry& geometry, const GeometryClusters& clusters);

} // namespace packtrace
