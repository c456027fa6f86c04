#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "compress/format/cluster/cluster_codec.h"
#include "compress/format/layout/packed_node.h"
#include "compress/format/trees/leaf_nodes.h"
#include "compress/format/trees/node_kernels.h"
#include "compress/format/trees/tree_grid.h"

namespace packtrace {

/// Rebuilds leaf nodes from the bits of their clusters. The bytes equal those that write_leaf_node() makes from
/// triangle boxes. Holds scratch memory; use one restorer per thread.
class LeafRestorer {
public:
  LeafRestorer() : kernels_(node_kernels::kernels()) {}
  explicit LeafRestorer(const node_kernels::Kernels& kernels) : kernels_(kernels) {}

  /// Begins the cluster that the next nodes belong to. It must be valid and lie within the tree's coordinates.
  void begin(const baked::GeometryRecord& geometry, const baked::TreeRecord& tree, const ClusterView& cluster);

  /// Boxes of a cluster's vertices, to be set before begin_placed().
  std::span<node_kernels::Box> vertex_boxes() { return boxes_; }
  /// Begins a cluster whose vertices are in vertex_boxes().
  /// @param bits begins with valid strips; 8 bytes behind them are readable
  void begin_placed(const uint8_t* bits, const IndexLayout& layout);

  /// Writes a leaf node and returns the box of all its leaves.
  /// @param leaves runs of triangles that exist in the cluster
  node_kernels::Box write(const LeafNode& leaves, uint32_t cluster, uint8_t ray_classes, baked::PackedNode& node);

private:
  void place_vertices(const baked::GeometryRecord& geometry, const baked::TreeRecord& tree, const ClusterView& cluster);
  void read_strips(const uint8_t* bits, const IndexLayout& layout);
  node_kernels::LeafCorners corners_of(uint32_t begin, uint32_t end) const;

  const node_kernels::Kernels& kernels_;
  /// Restart and left bits of the cluster's triangles.
  std::array<uint64_t, 2> restart_, left_;
  /// By triangle: number of strips that begin before it.
  std::array<uint8_t, 2 * kMaxClusterTriangles + 1> strips_before_;
  std::array<uint8_t, kMaxClusterTriangles> strip_begins_;                     ///< by strip: its first triangle
  std::array<node_kernels::Box, kMaxClusterVertices> boxes_;                   ///< by vertex
  std::array<uint8_t, kMaxClusterCorners + node_kernels::kSpareIds> vertices_; ///< by corner
};

/// Writes a node whose children are nodes, as write_inner_node() does, and returns the box of all children.
/// @param children the child nodes, already written
/// @param boxes by child: the box of its subtree
node_kernels::Box restore_inner_node(const node_kernels::Kernels& kernels, uint32_t first_child,
                                     std::span<const baked::PackedNode> children,
                                     std::span<const node_kernels::Box> boxes, baked::PackedNode& node);

} // namespace packtrace
