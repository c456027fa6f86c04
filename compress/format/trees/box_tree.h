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
  /// Half the surface. In double, as it overflows in float.
  double half_area() const {
    const double x = double{hi[0]} - lo[0], y = double{hi[1]} - lo[1], z = double{hi[2]} - lo[2];
    return x * y + y * z + z * x;
  }
};

/// A node over a run of BoxTree::order. Of an inner node (count > 1) the left child is the next node.
struct BoxTreeNode {
  TreeBox box;
  uint32_t first = 0, count = 0;
  uint32_t right = 0; ///< the right child's number; 0 for a leaf, which holds one box
};

/// A binary tree over boxes, nodes in preorder: 2 n - 1 of them for n boxes.
struct BoxTree {
  std::vector<BoxTreeNode> nodes;
  std::vector<uint32_t> order; ///< numbers of the boxes, from left to right
};

inline constexpr uint32_t kDefaultTreeDepth = 40;

/// Splits by the surface area heuristic over bins of the boxes' centres, and in half where that finds nothing or the
/// tree would become deeper than max_depth. Time O(n log n) but for boxes of exponentially growing size, where it is
/// O(n max_depth); on all threads; the result depends on the boxes only.
/// Source: Wald, "On fast construction of SAH-based bounding volume hierarchies" (2007).
/// @param boxes at most 2^31
/// @param max_depth levels of nodes, 33 or more, so that any number of boxes fits
BoxTree build_box_tree(std::span<const TreeBox> boxes, uint32_t max_depth = kDefaultTreeDepth);

/// The largest subtrees of that tree that have at most `max_count` boxes, and nothing below them.
/// @param order set to the boxes' numbers from left to right
/// @return where the subtrees end in it, ascending
std::vector<uint32_t> cut_boxes(std::span<const TreeBox> boxes, uint32_t max_count, std::vector<uint32_t>& order);

} // namespace packtrace
