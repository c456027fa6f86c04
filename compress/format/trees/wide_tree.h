#pragma once

#include <cstdint>
#include <vector>

#include "compress/format/trees/box_tree.h"
#include "compress/format/trees/reinsertion.h"

namespace packtrace {

inline constexpr uint32_t kWideTreeWidth = 8;

/// A node of a wide tree. Its children are consecutive.
struct WideNode {
  uint32_t source = 0;      ///< node of the binary tree with the same box and the same leaves below
  uint32_t first_child = 0; ///< larger than the node's own number
  uint32_t child_count = 0; ///< 2..8, or 0 for a leaf, which holds the one box of `source`
};

/// Collapses a binary tree with the least possible sum of the areas of inner nodes. Node 0 is the root. The nodes of a
/// subtree are contiguous, except its root, which is stored with its siblings.
/// Source: Ylitie, Karras, Laine, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs" (2017),
/// section 3.1, with leaves of one box.
std::vector<WideNode> collapse_box_tree(const BoxTree& tree);

/// A wide tree over boxes.
struct WideTree {
  BoxTree binary;              ///< the tree that was collapsed
  std::vector<WideNode> nodes; ///< empty without boxes
  uint32_t depth = 0;          ///< levels of nodes
};

/// Builds a binary tree (build_box_tree()), optimises it (reinsert_subtrees()) and collapses it. If reinsertion makes
/// the tree deeper than max_depth, the tree is rebuilt without it.
/// @param max_depth levels of nodes, at least 33
WideTree build_wide_tree(std::span<const TreeBox> boxes, uint32_t max_depth, const ReinsertionConfig& config = {});

} // namespace packtrace
