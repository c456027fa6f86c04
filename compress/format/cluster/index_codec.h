#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "pbrt_import/scene/math.h"

namespace packtrace {

inline constexpr uint32_t kMaxClusterTriangles = 128;
inline constexpr uint32_t kMaxClusterVertices = 256;
inline constexpr uint32_t kMaxClusterCorners = 3 * kMaxClusterTriangles;

/// Triangles as strips in which every triangle but a strip's first adds one corner c to the triangle (a, b, c) before:
///   right turn: (c, b, new), across the edge b-c;   left turn: (a, c, new), across the edge c-a.
/// The corners of all triangles in order, three for a strip's first and one for the others, are the corner list.
/// A corner is either fresh (the next vertex number not used before) or names an earlier vertex. The bits, in order:
///   T        restart: the triangle begins a strip
///   T        left: it is reached by a left turn (0 where restart is set)
///   T + 2 R  fresh, one per corner; exactly V are set
///   (T + 2 R - V) x bits_for_count(V)  the vertices of the corners that are not fresh, in order
/// Any triangle can be read alone: its place in the corner list follows from counting restart bits, the corner it keeps
/// from the last turn the other way, and the place of an explicit index from counting fresh bits.
struct IndexLayout {
  uint32_t triangle_count = 0; ///< T, 1..128
  uint32_t vertex_count = 0;   ///< V, 1..256
  uint32_t restart_count = 0;  ///< R, 1..T

  uint32_t corner_count() const { return triangle_count + 2 * restart_count; }
  uint32_t fresh_bit() const { return 2 * triangle_count; }
  uint32_t explicit_bit() const { return fresh_bit() + corner_count(); }
  uint32_t index_bits() const; ///< of one explicit index
  /// Length of all of it. Needs V <= corner_count().
  uint32_t total_bits() const { return explicit_bit() + (corner_count() - vertex_count) * index_bits(); }
};

/// What encode_strips() decided. Vertices are renumbered in order of first use.
struct Strips {
  IndexLayout layout;
  std::vector<uint8_t> restart, left;   ///< per triangle in strip order, 0 or 1
  std::vector<uint32_t> corners;        ///< the corner list, new vertex numbers
  std::vector<uint32_t> triangle_order; ///< new -> old triangle
  std::vector<uint32_t> vertex_order;   ///< new -> old vertex, those in use
};

class BitWriter;

/// Finds strips through triangles whose indices are below vertex_count. 1..128 triangles; at most 256 vertices in use.
/// Triangles keep their winding but may start at another of their corners.
/// @param group_ends where groups of triangles end, ascending, the last one at the end of all; none: all are one group.
///   A group's triangles stay together; the order of groups is free, and strips may go on from one to the next.
Strips find_strips(std::span<const Triangle> triangles, uint32_t vertex_count,
                   std::span<const uint32_t> group_ends = {});

void write_strips(const Strips& strips, BitWriter& writer);

/// All triangles in order into triangles[0..T), each index plus `base`.
void decode_triangles(const uint8_t* bits, const IndexLayout& layout, uint32_t base, std::span<Triangle> triangles);

/// Triangle number `index` alone.
Triangle decode_triangle(const uint8_t* bits, const IndexLayout& layout, uint32_t index);

/// Whether the bits are what write_strips() could have written: counts as stated, every index below V. decode_*() on
/// other bits is undefined.
bool strips_are_valid(const uint8_t* bits, const IndexLayout& layout);

} // namespace packtrace
