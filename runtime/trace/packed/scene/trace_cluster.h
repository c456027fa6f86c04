#pragma once

#include <vector>

#include "compress/format/file/baked_file.h"
#include "compress/format/layout/packed_node.h"
#include "runtime/trace/packed/kernels/kernel_types.h"

namespace packtrace {

/// Returns a cluster as kernels read it.
/// @param ray_classes ray classes of the cluster's material slot: baked::kVisibleToCamera, kVisibleToOcclusion,
/// kMaskedLeaves
packed::TraceCluster trace_cluster(const baked::TreeRecord& tree, const baked::GeometryRecord& geometry,
                                   const ClusterView& cluster, uint8_t ray_classes);

/// Decodes up to packed::kBatch triangles of any cluster, each coordinate rounded once; returns their number.
uint32_t decode_batch_exactly(const baked::TreeRecord& tree, const baked::GeometryRecord& geometry,
                              const ClusterView& cluster, uint32_t first, uint32_t count, packed::DecodedBatch& out);

/// Appends the vertices of any cluster in the tree's grid, three floats each, each coordinate rounded once.
void decode_vertices_exactly(const baked::TreeRecord& tree, const baked::GeometryRecord& geometry,
                             const ClusterView& cluster, std::vector<float>& out);

} // namespace packtrace
