#pragma once

#include <array>
#include <span>

#include "compress/format/cluster/cluster_codec.h"
#include "compress/format/layout/packed_node.h"
#include "compress/format/trees/leaf_nodes.h"
#include "compress/format/trees/node_kernels.h"
#include "compress/format/trees/tree_grid.h"

namespace packtrace {

/// Buffer for the boxes of a cluster's triangles.
using ClusterBoxes = std::array<TreeGridBox, kMaxClusterTriangles>;

/// Returns the boxes of a cluster's triangles in tree coordinates. All lie within +-kMaxTreeCoordinate, because
/// choose_tree_grid() or validation ensured that the grid holds the cluster.
/// @param room the returned span points into it
std::span<const TreeGridBox> triangle_boxes(const ClusterView& cluster, const TreeGridMap& map, ClusterBoxes& room);

/// Copies packed boxes into a node: origin, exponents and children's boxes.
void set_boxes(const node_kernels::NodeBoxes& boxes, baked::PackedNode& node);

/// Sets all other fields of a leaf node.
void set_leaves(const LeafNode& leaves, uint32_t cluster, uint8_t ray_classes, baked::PackedNode& node);

/// Sets all other fields of a node whose children are nodes. The children must have been written.
void set_children(uint32_t first_child, std::span<const baked::PackedNode> children, baked::PackedNode& node);

/// Packs a node's origin, exponents and children's boxes with the smallest exponents that fit; each box is rounded
/// outwards. Returns the box of all children.
/// @param boxes 1..8, of the children in slot order; coordinates within +-kMaxTreeCoordinate
TreeGridBox write_boxes(std::span<const TreeGridBox> boxes, baked::PackedNode& node);

/// Writes a leaf node and returns the box of all its leaves.
/// @param boxes of all triangles of the cluster
TreeGridBox write_leaf_node(const LeafNode& leaves, std::span<const TreeGridBox> boxes, uint32_t cluster,
                            uint8_t ray_classes, baked::PackedNode& node);

/// Writes a node whose children are nodes, and returns the box of all children. The children must have been written.
/// @param nodes all nodes of the tree
/// @param boxes by node of the tree: the box of its subtree
TreeGridBox write_inner_node(uint32_t first_child, uint32_t child_count, std::span<const baked::PackedNode> nodes,
                             std::span<const TreeGridBox> boxes, baked::PackedNode& node);

} // namespace packtrace
