#pragma once

#include <cstdint>

/// What making the nodes of a file over takes most time for, by the instructions of this processor. The results are the
/// same bits for all of them. Arrays of plain types only: nothing of another header may be compiled for AVX2.
namespace packtrace::node_kernels {

/// A box of tree coordinates: both halves become smaller where the box grows.
struct alignas(32) Box {
  int32_t lo[4];       ///< x, y, z, 0
  int32_t minus_hi[4]; ///< x, y, z, 0
};

/// A cluster's positions on the way into a tree's grid: coordinate = base + field * 2^shift.
struct VertexFields {
  const uint8_t* bits; ///< 8 bytes behind the last field are readable
  uint64_t first_bit;
  uint32_t count;     ///< vertices
  uint32_t widths[3]; ///< at most 57 in all
  int32_t base[3];    ///< modulo 2^32
  uint32_t shift;     ///< 0..31; field * 2^shift < 2^31
};

/// The corner list of a cluster (IndexLayout) as it lies in its payload.
struct CornerBits {
  const uint8_t* bits; ///< 8 bytes behind the last field are readable
  uint32_t fresh_bit, explicit_bit;
  uint32_t corner_count; ///< at most 384
  uint32_t vertex_count;
  uint32_t index_bits; ///< 0..8
};

/// Corners that a leaf's triangles bring, [begin, end), and two more: those that its first triangle keeps, or any of
/// its own.
struct LeafCorners {
  uint16_t begin, end;
  uint16_t kept[2];
};

/// Of a node, as PackedNode has them; a byte per child, the first one's lowest.
struct NodeBoxes {
  int32_t origin[3];
  uint32_t exponents;
  uint64_t lo[3], hi[3];
};

inline constexpr uint32_t kSpareIds = 32; ///< so many bytes behind the corners may be overwritten

/// A box for each vertex, without extent.
using PlaceVertices = void (*)(const VertexFields& fields, Box* boxes);
/// The vertex of each corner. Stays within its memory whatever the bits are, if vertex_count of them are fresh.
using NumberCorners = void (*)(const CornerBits& corners, uint8_t* vertices);
/// @param vertices by corner; kSpareIds more bytes are readable @param boxes by vertex
using BoxLeaves = void (*)(const Box* boxes, const uint8_t* vertices, const LeafCorners* leaves, uint32_t count,
                           Box* out);
/// A node's boxes from those of 1..8 children: the smallest exponents, each box rounded outwards.
/// @param whole the box of all
using PackChildren = void (*)(const Box* children, uint32_t count, NodeBoxes& node, Box& whole);

struct Kernels {
  PlaceVertices place_vertices;
  NumberCorners number_corners;
  BoxLeaves box_leaves;
  PackChildren pack_children;
};

extern const Kernels kPortable;
extern const Kernels kAvx2;

/// Those of this processor.
const Kernels& kernels();

} // namespace packtrace::node_kernels
