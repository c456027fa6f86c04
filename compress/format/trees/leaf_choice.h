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

inline Float4 load_lanes(const float* lanes) {
  Float4 out;
  std::memcpy(&out, lanes, sizeof out);
  return out;
}

/// Returns a box of integers in floats.
inline sweep_kernels::Box sweep_box(const TreeGridBox& box) {
  sweep_kernels::Box out{};
  for (size_t axis = 0; axis < 3; ++axis)
    out.minus_lo[axis] = -static_cast<float>(box.lo[axis]), out.hi[axis] = static_cast<float>(box.hi[axis]);
  return out;
}

inline void extend(sweep_kernels::Box& box, const sweep_kernels::Box& other) {
  const auto extend_end = [](float* end, const float* other_end) {
    const Float4 a = load_lanes(end), b = load_lanes(other_end), most = a > b ? a : b;
    std::memcpy(end, &most, sizeof most);
  };
  extend_end(box.minus_lo, other.minus_lo);
  extend_end(box.hi, other.hi);
}

/// Half the surface area of a box.
inline float half_area(const sweep_kernels::Box& box) {
  const Float4 size = load_lanes(box.hi) + load_lanes(box.minus_lo);
  const Float4 faces = size * __builtin_shufflevector(size, size, 1, 2, 0, 3);
  const Float4 sums =
      faces + __builtin_shufflevector(faces, faces, 1, 0, 3, 2) + __builtin_shufflevector(faces, faces, 2, 3, 0, 1);
  float area; // goes through memory because GCC 12 reads vector lanes wrongly under sanitizers
  std::memcpy(&area, &sums, sizeof area);
  return area;
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
