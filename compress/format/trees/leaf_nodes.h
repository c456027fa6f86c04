#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "compress/format/layout/packed_node.h"

namespace packtrace {

/// A box of integer tree coordinates (TreeRecord); both ends are inside.
struct TreeGridBox {
  std::array<int32_t, 3> lo, hi;

  void extend(const TreeGridBox& other) {
    for (size_t axis = 0; axis < 3; ++axis) {
      lo[axis] = other.lo[axis] < lo[axis] ? other.lo[axis] : lo[axis];
      hi[axis] = other.hi[axis] > hi[axis] ? other.hi[axis] : hi[axis];
    }
  }
};

/// Relative costs of a ray's visits. The surface area heuristic weights them by the areas of the boxes.
struct TreeCosts {
  double node = 1.0;  ///< visiting a node: up to eight box tests
  double leaf = 1.0;  ///< locating a leaf's triangles in the cluster's streams
  double batch = 1.0; ///< decoding and testing up to eight triangles of a leaf
  /// Overhead of one more node (work in the nodes above, memory), in units of visiting a node of typical area.
  double extra_node = 0.35;
  uint32_t max_leaf_triangles = baked::kMaxLeafTriangles;
};

/// Half area of a node of 64 triangles, if the cluster's half area divides evenly among its triangles.
inline double typical_node_area(double cluster_half_area, uint32_t triangle_count) {
  constexpr double kTypical = 64.0; // triangles per node
  return cluster_half_area * kTypical / triangle_count;
}

/// Leaves that make up one leaf node, in the order of the stream.
struct LeafNode {
  uint32_t first_triangle = 0;                        ///< within the cluster
  uint32_t leaf_count = 0;                            ///< 1..8
  std::array<uint8_t, baked::kNodeWidth> triangles{}; ///< number of triangles of each leaf
};

/// Cuts a cluster's triangles, in stream order, into leaves, and groups the leaves into nodes. The result is the
/// cheapest choice within a binary tree over the stream order that the surface area heuristic builds.
/// @param boxes of the triangles, 1..128
/// @param typical_area half surface area of a box; the area of the node that TreeCosts::extra_node refers to
/// @param nodes the nodes are appended to it
void find_leaf_nodes(std::span<const TreeGridBox> boxes, const TreeCosts& costs, double typical_area,
                     std::vector<LeafNode>& nodes);

} // namespace packtrace
