#pragma once

#include <span>

#include "compress/format/file/baked_file.h"
#include "compress/format/layout/packed_node.h"
#include "runtime/trace/packed/kernels/kernel_types.h"

namespace packtrace {

/// A cluster as kernels read it.
/// @param ray_classes baked::kCameraBelow and so on, for its material slot
packed::TraceCluster trace_cluster(const baked::TreeRecord& tree, const baked::GeometryRecord& geometry,
                                   const ClusterView& cluster, uint8_t ray_classes);

/// The vertices of one triangle, in the tree's coordinates: the bits that kernels decode.
/// @param cluster not packed::kWide
void decode_vertices(const packed::TraceCluster& cluster, uint32_t triangle, Vec3 (&vertices)[3]);

/// Decodes up to packed::kBatch triangles of any cluster, exactly rounded; returns how many.
uint32_t decode_batch_exactly(const baked::TreeRecord& tree, const baked::GeometryRecord& geometry,
                              const ClusterView& cluster, uint32_t first, uint32_t count, packed::DecodedBatch& out);

} // namespace packtrace
