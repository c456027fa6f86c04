#pragma once

#include <array>
#include <span>

#include "compress/format/cluster/cluster_codec.h"
#include "compress/format/trees/leaf_nodes.h"
#include "compress/format/trees/node_kernels.h"
#include "compress/format/layout/packed_node.h"
#include "compress/format/trees/tree_grid.h"

namespace packtrace {

/// Room for the boxes of a cluster's triangles.
using ClusterBoxes = std::array<TreeGridBox, kMaxClusterTriangles>;

/// The boxes of a cluster's triangles in a tree's coordinates; all lie within +-kMaxTreeCoordinate, as the tree's
/// record was chosen or checked so.
std::span<const TreeGridBox> triangle_boxes(const ClusterView& cluster, const TreeGridMap& map, ClusterBoxes& room);

/// Sets a node's origin, exponents and children's boxes to those that were packed.
void set_boxes(const node_kernels::NodeBoxes& boxes, baked::PackedNode& node);

/// Sets all else of a node with leaves.
void set_leaves(const LeafNode& leaves, uint32_t cluster, uint8_t ray_classes, baked::PackedNode& node);

/// Sets all else of a node of nodes, which are made already.
void set_children(uint32_t first_child, std::span<const baked::PackedNode> children, baked::PackedNode& node);

/// Packs a node's origin, exponents and children's boxes: the smallest exponents, each box rounded outwards. Returns
/// the box of all.
/// @param boxes 1..8, of children in the order of slots; coordinates within +-kMaxTreeCoordinate
TreeGridBox write_boxes(std::span<const TreeGridBox> boxes, baked::PackedNode& node);

/// Makes a node with leaves. Returns the box of all.
/// @param boxes of the cluster's triangles
TreeGridBox write_leaf_node(const LeafNode& leaves, std::span<const TreeGridBox> boxes, uint32_t cluster,
                            uint8_t ray_classes, baked::PackedNode& node);

/// Makes a node of nodes, which are made already. Returns the box of all.
/// @param nodes of the tree
/// @param boxes of what lies below each
TreeGridBox write_inner_node(uint32_t first_child, uint32_t child_count, std::span<const baked::PackedNode> nodes,
                             std::span<const TreeGridBox> boxes, baked::PackedNode& node);

} // namespace packtrace
