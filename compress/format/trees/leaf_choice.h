#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "compress/format/cluster/index_codec.h"
#include "compress/format/trees/leaf_nodes.h"
#include "compress/format/trees/sweep_kernels.h"

namespace packtrace {

using Float4 = float __attribute__((vector_size(16)));
using Int4 = int32_t __attribute__((vector_size(16)));

inline Float4 max_of(Float4 a, Float4 b) { return a > b ? a : b; }

/// A box in SIMD lanes. The low end is negated, so that one maximum per vector extends the box.
struct FloatBox {
  Float4 minus_lo, hi; ///< the fourth lanes are 0

  static FloatBox of(const sweep_kernels::Box& box) {
    FloatBox out;
    static_assert(sizeof out == sizeof box);
    std::memcpy(&out, &box, sizeof out);
    return out;
  }
  static FloatBox of(const TreeGridBox& box) {
    float lanes[8]{};
    for (size_t axis = 0; axis < 3; ++axis)
      lanes[axis] = -static_cast<float>(box.lo[axis]), lanes[4 + axis] = static_cast<float>(box.hi[axis]);
    FloatBox out;
    std::memcpy(&out, lanes, sizeof out);
    return out;
  }
  sweep_kernels::Box stored() const {
    sweep_kernels::Box out;
    std::memcpy(&out, this, sizeof out);
    return out;
  }
  void extend(const FloatBox& other) {
    minus_lo = max_of(minus_lo, other.minus_lo);
    hi = max_of(hi, other.hi);
  }
};

/// Half the surface area of a box, in the first lane.
inline Float4 half_area(const FloatBox& box) {
  const Float4 size = box.hi + box.minus_lo;
  const Float4 faces = size * __builtin_shufflevector(size, size, 1, 2, 0, 3);
  return faces + __builtin_shufflevector(faces, faces, 1, 0, 3, 2) + __builtin_shufflevector(faces, faces, 2, 3, 0, 1);
}

/// Returns the first lane. Goes through memory because GCC 12 reads vector lanes wrongly under sanitizers.
inline float first_lane(const Float4& lanes) {
  float first;
  std::memcpy(&first, &lanes, sizeof first);
  return first;
}

/// A node of a binary tree over runs of a cluster's triangles, stored in preorder: the left child is the next node.
struct RunNode {
  float area;                                     ///< half the surface area of its box
  uint8_t first, count;                           ///< run of triangles
  uint8_t right;                                  ///< number of the right child; 0 without children
  bool is_node;                                   ///< cheaper as one PackedNode than split into nodes of both children
  float node_cost;                                ///< least cost of the run as one or several nodes
  alignas(16) float leaf_cost[baked::kNodeWidth]; ///< [i - 1]: least cost of the run as at most i leaves
};

/// Cuts the triangles below nodes[0] into leaves, and groups the leaves into nodes, at the least cost among the cuts of
/// this tree.
/// @param nodes input: area, first, count and right; the function sets the other members
/// @param typical_area see find_leaf_nodes()
/// @param out the nodes are appended to it
void choose_leaf_nodes(std::span<RunNode> nodes, const TreeCosts& costs, double typical_area,
                       std::vector<LeafNode>& out);

} // namespace packtrace
