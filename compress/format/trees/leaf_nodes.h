#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "compress/format/layout/packed_node.h"

namespace packtrace {

/// A box of whole tree coordinates (TreeRecord), both ends inside.
struct TreeGridBox {
  std::array<int32_t, 3> lo, hi;

  void extend(const TreeGridBox& other) {
    for (size_t axis = 0; axis < 3; ++axis) {
      lo[axis] = other.lo[axis] < lo[axis] ? other.lo[axis] : lo[axis];
      hi[axis] = other.hi[axis] > hi[axis] ? other.hi[axis] : hi[axis];
    }
  }
};

/// What a ray's visit costs, on one scale; the surface area heuristic weighs them by the boxes' areas.
struct TreeCosts {
  double node = 1.0;        ///< a node: up to eight boxes
  double leaf = 1.0;        ///< finding a leaf's place in its stream
  double batch = 1.0;       ///< decoding and testing up to eight triangles of a leaf
  double extra_node = 0.35; ///< one more node, in those above, in memory and so on: in visits of a node of typical area
  uint32_t max_leaf_triangles = baked::kMaxLeafTriangles;
};

/// The area of nodes of usual size that a cluster's triangles could be cut into.
inline double typical_node_area(double cluster_half_area, uint32_t triangle_count) {
  constexpr double kTypical = 64.0; // triangles of a node
  return cluster_half_area * kTypical / triangle_count;
}

/// Leaves that make up one node, in the order of the stream.
struct LeafNode {
  uint32_t first_triangle = 0;                        ///< within the cluster
  uint32_t leaf_count = 0;                            ///< 1..8
  std::array<uint8_t, baked::kNodeWidth> triangles{}; ///< of each leaf
};

/// Cuts a cluster's triangles, in their order in its stream, into leaves, and those into nodes: the best that choices
/// in a binary tree over that order give, whose splits follow the surface area heuristic.
/// @param boxes of the triangles, 1..128
/// @param typical_area what TreeCosts::extra_node counts in, half the surface of a box
/// @param nodes appended to
void find_leaf_nodes(std::span<const TreeGridBox> boxes, const TreeCosts& costs, double typical_area,
                     std::vector<LeafNode>& nodes);

} // namespace packtrace
