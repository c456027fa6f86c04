#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <type_traits>

namespace packtrace::baked {

/// A node has at most this many children.
inline constexpr uint32_t kNodeWidth = 8;
/// Triangles of a leaf at most; leaves are runs of a cluster's triangles.
inline constexpr uint32_t kMaxLeafTriangles = 16;
/// Levels of nodes on any way from the root down. Traversal stacks are made for it.
inline constexpr uint32_t kMaxTreeDepth = 48;

// PackedNode::ray_classes
inline constexpr uint8_t kCameraBelow = 1u << 0;    ///< some cluster below is seen by camera rays
inline constexpr uint8_t kOcclusionBelow = 1u << 1; ///< some cluster below occludes
inline constexpr uint8_t kMaskedLeaves = 1u << 2;   ///< hits in this node's leaves must look into a mask

// PackedNode::children
inline constexpr uint8_t kNoChild = 0;
inline constexpr uint8_t kInnerChild = 0xff; ///< else 1..kMaxLeafTriangles: a leaf of that many triangles

/// A node of an 8-wide tree over runs of clusters' triangles. Boxes are lattice boxes of the tree's grid:
///   lo = origin + (lo[axis][child] << exponent(axis)),  hi = origin + (hi[axis][child] << exponent(axis))
/// rounded outwards, so exact integers contain what lies below; |coordinate| < 2^31. All children of a node are nodes,
/// or all are leaves. Children that are nodes follow each other from first_child on, in the order of their slots;
/// leaves are runs of the triangles of one cluster, which follow each other in its stream from first_triangle on, in
/// the order of their slots. Slots in use come first. Idea of child boxes relative to their parent: Ylitie, Karras,
/// Laine, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs" (2017).
struct PackedNode {
  std::array<int32_t, 3> origin; ///< lattice, less the tree's origin
  uint16_t exponents;            ///< 5 bits per axis, x lowest, each 0..23
  uint8_t ray_classes;
  uint8_t first_triangle; ///< of the first leaf, within the cluster; 0 without leaves
  uint32_t first_child;   ///< node of the same tree, above this node's own number; 0 where the children are leaves
  uint32_t cluster;       ///< of the leaves: index in the cluster section; 0 without leaves
  std::array<uint8_t, kNodeWidth> children;
  std::array<std::array<uint8_t, kNodeWidth>, 3> lo; ///< [axis][child]; 255 where there is no child,
  std::array<std::array<uint8_t, kNodeWidth>, 3> hi; ///< and 0: boxes that no ray hits

  constexpr uint32_t exponent(uint32_t axis) const { return (uint32_t{exponents} >> (5 * axis)) & 31u; }
  constexpr bool has_leaves() const { return children[0] != kInnerChild; }
};
static_assert(sizeof(PackedNode) == 80 && std::is_trivially_copyable_v<PackedNode>);

// TreeRecord::geometry
inline constexpr uint32_t kWorldTree = ~0u; ///< over all world-space geometries but those with a tree of their own

/// Tree coordinates of vertices stay within +-this, so that 255 << 23 covers any extent.
inline constexpr int32_t kMaxTreeCoordinate = (1 << 30) - (1 << 23);

/// One traceable thing: a geometry, or all world-space geometry of the scene together. Its grid has points
/// (origin + p) * step_mantissa * 2^step_exponent for integers p with |p| <= kMaxTreeCoordinate; nodes and rays live in
/// p. A geometry's lattice point q is p = q * 2^(its step_exponent - the tree's) - origin, with the same step_mantissa:
/// exact where its step is the coarser one, else between the tree's points, and boxes are rounded outwards.
/// The origin is 0 along an axis unless it makes every coordinate smaller: where all coordinates have one sign and none
/// is more than twice another. So p as a float is off by no more than the float position is (compare UnitSpace).
struct TreeRecord {
  uint64_t first_node; ///< into the node section
  uint32_t node_count; ///< 0: nothing to hit
  uint32_t depth;      ///< levels of nodes, at most kMaxTreeDepth
  std::array<int64_t, 3> origin;
  uint32_t step_mantissa;
  int32_t step_exponent;
  uint32_t geometry; ///< or kWorldTree
  uint32_t reserved;
};
static_assert(sizeof(TreeRecord) == 56 && std::is_trivially_copyable_v<TreeRecord>);

} // namespace packtrace::baked
