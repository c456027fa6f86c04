#pragma once

#include <cstdint>
#include <vector>

#include "compress/format/layout/packed_node.h"
#include "compress/format/trees/leaf_nodes.h"
#include "compress/format/trees/reinsertion.h"

namespace packtrace {

/// Leaf nodes and, for each, the box of all its leaves.
struct LeafNodes {
  std::vector<baked::PackedNode> nodes;
  std::vector<TreeGridBox> boxes;
};

/// The nodes of a tree.
struct NodeTree {
  std::vector<baked::PackedNode> nodes; ///< root first; empty without leaf nodes
  std::vector<TreeGridBox> boxes;       ///< by node: box of its subtree
  uint32_t depth = 0;                   ///< levels of nodes
};

/// Builds the inner nodes over leaf nodes.
/// Throws Error(kLimitExceeded) for more than 2^30 leaf nodes.
NodeTree build_node_tree(const LeafNodes& leaves, const ReinsertionConfig& moves);

} // namespace packtrace
