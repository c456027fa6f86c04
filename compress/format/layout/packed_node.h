#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <type_traits>

namespace packtrace::baked {

/// Maximum number of children of a node.
inline constexpr uint32_t kNodeWidth = 8;
/// Maximum number of triangles in a leaf. A leaf is a run of a cluster's triangles.
inline constexpr uint32_t kMaxLeafTriangles = 16;
/// Maximum number of nodes on a path from the root. Traversal stacks are sized for it.
inline constexpr uint32_t kMaxTreeDepth = 48;

// PackedNode::ray_classes
inline constexpr uint8_t kVisibleToCamera = 1u << 0;    ///< a cluster below is visible to camera rays
inline constexpr uint8_t kVisibleToOcclusion = 1u << 1; ///< a cluster below occludes
inline constexpr uint8_t kMaskedLeaves = 1u << 2;       ///< hits in this node's leaves require a mask lookup

// PackedNode::children
inline constexpr uint8_t kNoChild = 0;
inline constexpr uint8_t kInnerChild = 0xff; ///< values 1..kMaxLeafTriangles: a leaf of that many triangles

/// A node of an 8-wide tree over runs of clusters' triangles. The boxes of its children are integer boxes in the tree's
/// grid:
///   lo = origin + (lo[axis][child] << exponent(axis)),  hi = origin + (hi[axis][child] << exponent(axis))
/// They are rounded outwards, so they contain the child's triangles exactly; |coordinate| < 2^31. Either all children
/// are nodes, or all are leaves; a node whose children are leaves is called a leaf node. Slots in use come first. Child
/// nodes are consecutive from first_child on, in slot order. Leaves are consecutive runs of triangles of one cluster,
/// from first_triangle on, in slot order.
/// Source of the child boxes relative to their parent: Ylitie, Karras, Laine, "Efficient incoherent ray traversal on
/// GPUs through compressed wide BVHs" (2017).
struct PackedNode {
  std::array<int32_t, 3> origin; ///< in tree coordinates
  uint16_t exponents;            ///< 5 bits per axis, x lowest, each 0..23
  uint8_t ray_classes;
  uint8_t first_triangle; ///< first triangle of the first leaf, within the cluster; 0 without leaves
  uint32_t first_child;   ///< number within the tree, above this node's own; 0 if the children are leaves
  uint32_t cluster;       ///< cluster of the leaves: index in the cluster section; 0 without leaves
  std::array<uint8_t, kNodeWidth> children;
  std::array<std::array<uint8_t, kNodeWidth>, 3> lo; ///< [axis][child]; unused slots have lo 255
  std::array<std::array<uint8_t, kNodeWidth>, 3> hi; ///< and hi 0: no ray hits such a box

  constexpr uint32_t exponent(uint32_t axis) const { return (uint32_t{exponents} >> (5 * axis)) & 31u; }
  constexpr bool has_leaves() const { return children[0] != kInnerChild; }
};
static_assert(sizeof(PackedNode) == 80 && std::is_trivially_copyable_v<PackedNode>);

// TreeRecord::geometry
inline constexpr uint32_t kWorldTree = ~0u; ///< tree over all world-space geometries without their own tree

/// Tree coordinates of vertices are within +-this, so that 255 << 23 covers any extent.
inline constexpr int32_t kMaxTreeCoordinate = (1 << 30) - (1 << 23);

/// A tree over one geometry, or over all world-space geometry of the scene together. Its grid consists of the points
/// (origin + p) * step_mantissa * 2^step_exponent for integers p with |p| <= kMaxTreeCoordinate. Nodes and rays use the
/// coordinates p. A geometry's lattice point q has p = q * 2^(its step_exponent - the tree's) - origin; both have the
/// same step_mantissa. p is an integer if the geometry's step is not finer than the tree's; otherwise boxes are rounded
/// outwards to integers.
/// Along each axis the origin is 0 unless all coordinates have one sign and none is more than twice another. Only then
/// does an origin make every coordinate smaller. So p as a float has no larger error than the float position (compare
/// UnitSpace).
struct TreeRecord {
  uint64_t first_node; ///< into the node section
  uint32_t node_count; ///< 0: an empty tree
  uint32_t depth;      ///< levels of nodes, at most kMaxTreeDepth
  std::array<int64_t, 3> origin;
  uint32_t step_mantissa;
  int32_t step_exponent;
  uint32_t geometry; ///< or kWorldTree
  uint32_t reserved;
};
static_assert(sizeof(TreeRecord) == 56 && std::is_trivially_copyable_v<TreeRecord>);

} // namespace packtrace::baked
