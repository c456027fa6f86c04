#pragma once

#include <cstdint>

/// SIMD kernels for the most expensive parts of restoring a file's nodes, one set per instruction set. All sets return
/// the same bits. The interface uses arrays of plain types only, because no inline function of another header may be
/// compiled for AVX2.
namespace packtrace::node_kernels {

/// A box of tree coordinates. Growing the box makes all lanes smaller, so extending it is a minimum.
struct alignas(32) Box {
  int32_t lo[4];       ///< x, y, z, 0
  int32_t minus_hi[4]; ///< x, y, z, 0
};

/// Position fields of a cluster, and their map to a tree's grid: coordinate = base + field * 2^shift.
struct VertexFields {
  const uint8_t* bits; ///< 8 bytes behind the last field are readable
  uint64_t first_bit;
  uint32_t count;     ///< number of vertices
  uint32_t widths[3]; ///< sum at most 57
  int32_t base[3];    ///< modulo 2^32
  uint32_t shift;     ///< 0..31; field * 2^shift < 2^31
};

/// The corner list of a cluster (IndexLayout) in its payload.
struct CornerBits {
  const uint8_t* bits; ///< 8 bytes behind the last field are readable
  uint32_t fresh_bit, explicit_bit;
  uint32_t corner_count; ///< at most 384
  uint32_t vertex_count;
  uint32_t index_bits; ///< 0..8
};

/// Corners of a leaf: the corners [begin, end) that its triangles add, and the two corners that its first triangle
/// keeps. If the first triangle begins a strip, `kept` repeats one of its corners.
struct LeafCorners {
  uint16_t begin, end;
  uint16_t kept[2];
};

/// Boxes of a PackedNode; one byte per child, the first child in the lowest byte.
struct NodeBoxes {
  int32_t origin[3];
  uint32_t exponents;
  uint64_t lo[3], hi[3];
};

inline constexpr uint32_t kSpareIds = 32; ///< number of bytes behind the corners that kernels may overwrite

/// Writes the box of each vertex. The vertices are grid points, so the boxes have no extent.
using PlaceVertices = void (*)(const VertexFields& fields, Box* boxes);
/// Writes the vertex of each corner. Stays within its memory for any bits, provided that exactly vertex_count are
/// fresh.
using NumberCorners = void (*)(const CornerBits& corners, uint8_t* vertices);
/// Writes the box of each leaf.
/// @param vertices by corner; kSpareIds more bytes are readable
/// @param boxes by vertex
using BoxLeaves = void (*)(const Box* boxes, const uint8_t* vertices, const LeafCorners* leaves, uint32_t count,
                           Box* out);
/// Packs a node's boxes from the boxes of 1..8 children: the smallest exponents that fit, each box rounded outwards.
/// @param whole receives the box of all children
using PackChildren = void (*)(const Box* children, uint32_t count, NodeBoxes& node, Box& whole);

struct Kernels {
  PlaceVertices place_vertices;
  NumberCorners number_corners;
  BoxLeaves box_leaves;
  PackChildren pack_children;
};

extern const Kernels kPortable;
extern const Kernels kAvx2;

/// Returns the fastest set that this processor supports.
const Kernels& kernels();

} // namespace packtrace::node_kernels
