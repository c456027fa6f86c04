#pragma once

#include <cstdint>
#include <vector>

#include "compress/format/trees/box_tree.h"
#include "compress/format/trees/reinsertion.h"

namespace packtrace {

inline constexpr uint32_t kWideTreeWidth = 8;

/// A node of a wide tree. Children follow each other.
struct WideNode {
  uint32_t source = 0;      ///< the node of the binary tree that it stands for, whose box is its own
  uint32_t first_child = 0; ///< above the node's own number
  uint32_t child_count = 0; ///< 2..8, or 0 for one of the boxes: source's only one
};

/// Collapses a binary tree so that the sum of the inner nodes' areas is the least that any choice among its nodes
/// gives. Node 0 is the root; a subtree's nodes lie together but for its root, which lies beside its siblings. Source:
/// Ylitie, Karras, Laine, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs" (2017),
/// section 3.1, with leaves of one box.
std::vector<WideNode> collapse_box_tree(const BoxTree& tree);

/// A wide tree over boxes.
struct WideTree {
  BoxTree binary;              ///< what it was collapsed from
  std::vector<WideNode> nodes; ///< none for no boxes
  uint32_t depth = 0;          ///< levels of nodes
};

/// Splits boxes (build_box_tree()), moves subtrees (reinsert_subtrees()), and collapses what comes of it. Where moved
/// subtrees would make the tree deeper than max_depth, they stay.
/// @param max_depth levels of nodes, 33 or more
WideTree build_wide_tree(std::span<const TreeBox> boxes, uint32_t max_depth, const ReinsertionConfig& config = {});

} // namespace packtrace
