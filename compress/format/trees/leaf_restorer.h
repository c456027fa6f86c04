#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "compress/format/cluster/cluster_codec.h"
#include "compress/format/trees/leaf_nodes.h"
#include "compress/format/trees/node_kernels.h"
#include "compress/format/layout/packed_node.h"
#include "compress/format/trees/tree_grid.h"

namespace packtrace {

/// Makes nodes with leaves from the bits of their clusters, as write_leaf_node() does from boxes of triangles: the
/// same bytes. It has the room that takes; one for each thread.
class LeafRestorer {
public:
  LeafRestorer() : kernels_(node_kernels::kernels()) {}
  explicit LeafRestorer(const node_kernels::Kernels& kernels) : kernels_(kernels) {}

  /// The cluster that the next nodes belong to. It is valid, and lies within the tree's coordinates.
  void begin(const baked::GeometryRecord& geometry, const baked::TreeRecord& tree, const ClusterView& cluster);

  /// Makes a node. Returns the box of all.
  /// @param leaves of triangles that the cluster has
  node_kernels::Box write(const LeafNode& leaves, uint32_t cluster, uint8_t ray_classes, baked::PackedNode& node);

private:
  void place_vertices(const baked::GeometryRecord& geometry, const baked::TreeRecord& tree, const ClusterView& cluster);
  void read_strips(const uint8_t* bits, const IndexLayout& layout);
  node_kernels::LeafCorners corners_of(uint32_t begin, uint32_t end) const;

  const node_kernels::Kernels& kernels_;
  std::array<uint64_t, 2> restart_, left_;                          ///< bits of the cluster's triangles
  std::array<uint8_t, 2 * kMaxClusterTriangles + 1> strips_before_; ///< by triangle: strips that begin before it
  std::array<uint8_t, kMaxClusterTriangles> strip_begins_;          ///< by strip: its first triangle
  std::array<node_kernels::Box, kMaxClusterVertices> boxes_;        ///< by vertex
  std::array<uint8_t, kMaxClusterCorners + node_kernels::kSpareIds> vertices_; ///< by corner
};

/// Makes a node of nodes, as write_inner_node() does. Returns the box of all.
/// @param children nodes that lie below, made already
/// @param boxes of what lies below each of them
node_kernels::Box restore_inner_node(const node_kernels::Kernels& kernels, uint32_t first_child,
                                     std::span<const baked::PackedNode> children,
                                     std::span<const node_kernels::Box> boxes, baked::PackedNode& node);

} // namespace packtrace
