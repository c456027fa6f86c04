#pragma once

#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "compress/format/trees/leaf_nodes.h"

namespace packtrace {

using Float4 = float __attribute__((vector_size(16)));
using Int4 = int32_t __attribute__((vector_size(16)));

inline Float4 max_of(Float4 a, Float4 b) { return a > b ? a : b; }

/// A box of four lanes, so that one instruction extends a side: low ends negated, so that all of it are maxima.
struct FloatBox {
  Float4 minus_lo, hi; ///< the fourth lanes are 0

  static FloatBox of(const TreeGridBox& box) {
    float lanes[8]{};
    for (size_t axis = 0; axis < 3; ++axis)
      lanes[axis] = -static_cast<float>(box.lo[axis]), lanes[4 + axis] = static_cast<float>(box.hi[axis]);
    FloatBox out;
    std::memcpy(&out, lanes, sizeof out);
    return out;
  }
  void extend(const FloatBox& other) {
    minus_lo = max_of(minus_lo, other.minus_lo);
    hi = max_of(hi, other.hi);
  }
};

/// Half the surface of a box, in the first lane.
inline Float4 half_area(const FloatBox& box) {
  const Float4 size = box.hi + box.minus_lo;
  const Float4 faces = size * __builtin_shufflevector(size, size, 1, 2, 0, 3);
  return faces + __builtin_shufflevector(faces, faces, 1, 0, 3, 2) + __builtin_shufflevector(faces, faces, 2, 3, 0, 1);
}

/// The first lane. Through memory, as GCC 12 reads lanes of vectors wrongly under sanitizers.
inline float first_lane(const Float4& lanes) {
  float first;
  std::memcpy(&first, &lanes, sizeof first);
  return first;
}

/// Where a run of `count` triangles is best split: the least cost, of those the nearest to the middle.
struct RunSplit {
  float cost;
  uint32_t left;

  void improve(float other, uint32_t at, uint32_t count) {
    const auto off_middle = [count](uint32_t split) {
      return split > count - split ? 2 * split - count : count - 2 * split;
    };
    if (other < cost || (other == cost && off_middle(at) < off_middle(left))) cost = other, left = at;
  }
};

/// A node of a binary tree over runs of a cluster's triangles, in preorder: the left child is the next node.
struct RunNode {
  float area;                                     ///< half the surface of its box
  uint8_t first, count, right;                    ///< triangles; the right child's number
  bool is_node;                                   ///< rather than nodes on both sides
  float node_cost;                                ///< as one node or several
  alignas(16) float leaf_cost[baked::kNodeWidth]; ///< as i leaves at most, in [i - 1]
};

/// Cuts the triangles below nodes[0] into leaves, and those into nodes, at the least cost that cuts of this tree allow.
/// @param nodes with area, first, count and right; the rest is set
/// @param typical_area see find_leaf_nodes()
/// @param out appended to
void choose_leaf_nodes(std::span<RunNode> nodes, const TreeCosts& costs, double typical_area,
                       std::vector<LeafNode>& out);

} // namespace packtrace
