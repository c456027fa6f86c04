#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace packtrace {

/// An axis-aligned box of finite floats, lo <= hi.
struct TreeBox {
  std::array<float, 3> lo, hi;

  void extend(const TreeBox& other) {
    for (size_t axis = 0; axis < 3; ++axis) {
      lo[axis] = other.lo[axis] < lo[axis] ? other.lo[axis] : lo[axis];
      hi[axis] = other.hi[axis] > hi[axis] ? other.hi[axis] : hi[axis];
    }
  }
  /// Half the surface area; double, because float would overflow.
  double half_area() const {
    const double x = double{hi[0]} - lo[0], y = double{hi[1]} - lo[1], z = double{hi[2]} - lo[2];
    return x * y + y * z + z * x;
  }
};

/// A node over a run of BoxTree::order. The left child of an inner node (count > 1) is the next node.
struct BoxTreeNode {
  TreeBox box;
  uint32_t first = 0, count = 0;
  uint32_t right = 0; ///< number of the right child; 0 for a leaf, which holds one box
};

/// A binary tree over boxes. Nodes are in preorder; n boxes have 2 n - 1 nodes.
struct BoxTree {
  std::vector<BoxTreeNode> nodes;
  std::vector<uint32_t> order; ///< box numbers of the leaves, from left to right
};

inline constexpr uint32_t kDefaultTreeDepth = 40;

/// Builds a binary tree by the surface area heuristic over binned box centres. Runs are split in half where no split is
/// found or where the tree would become deeper than max_depth. Takes O(n log n) time, except for boxes of exponentially
/// growing size, which take O(n max_depth). Runs on all threads; the result depends only on the boxes.
/// Source: Wald, "On fast construction of SAH-based bounding volume hierarchies" (2007).
/// @param boxes fewer than 2^31
/// @param max_depth levels of nodes; at least 33, so that any number of boxes fits
BoxTree build_box_tree(std::span<const TreeBox> boxes, uint32_t max_depth = kDefaultTreeDepth);

/// Cuts boxes into the largest subtrees with at most `max_count` boxes that such a build finds. The cost of a side
/// counts its boxes in units of max_count, rounded up.
/// @param order receives the boxes' numbers, from left to right
/// @return ends of the subtrees in `order`, ascending
std::vector<uint32_t> cut_boxes(std::span<const TreeBox> boxes, uint32_t max_count, std::vector<uint32_t>& order);

} // namespace packtrace
