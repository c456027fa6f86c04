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

/// Layout of a cluster's triangles as strips. The first triangle of a strip has three new corners; every other triangle
/// adds one corner to the triangle (a, b, c) before it:
///   right turn: (c, b, new), across the edge b-c;   left turn: (a, c, new), across the edge c-a.
/// The corner list holds the added corners of all triangles in order. A corner is either fresh (the next unused vertex
/// number) or names an earlier vertex. T triangles, R strips and V vertices take these bits, in order:
///   T        restart: the triangle begins a strip
///   T        left: the triangle follows a left turn (0 if restart is set)
///   T + 2 R  fresh, one per corner; exactly V are set
///   (T + 2 R - V) x bits_for_count(V)  vertex numbers of the corners that are not fresh, in order
/// Any triangle can be read alone: its place in the corner list follows from a count of restart bits, its kept corner
/// from the last turn in the other direction, and the place of an explicit index from a count of fresh bits.
struct IndexLayout {
  uint32_t triangle_count = 0; ///< T, 1..128
  uint32_t vertex_count = 0;   ///< V, 1..256
  uint32_t strip_count = 0;    ///< R, 1..T

  uint32_t corner_count() const { return triangle_count + 2 * strip_count; }
  uint32_t fresh_bit() const { return 2 * triangle_count; }
  uint32_t explicit_bit() const { return fresh_bit() + corner_count(); }
  uint32_t index_bits() const; ///< width of one explicit index
  /// Length of the whole layout. Needs V <= corner_count().
  uint32_t total_bits() const { return explicit_bit() + (corner_count() - vertex_count) * index_bits(); }
};

/// Result of find_strips(). Vertices are renumbered in order of first use.
struct Strips {
  IndexLayout layout;
  std::vector<uint8_t> restart, left;   ///< per triangle in strip order, 0 or 1
  std::vector<uint32_t> corners;        ///< the corner list, with new vertex numbers
  std::vector<uint32_t> triangle_order; ///< new -> old triangle
  std::vector<uint32_t> vertex_order;   ///< new -> old vertex, for the vertices in use
};

class BitWriter;

/// Finds strips through 1..128 triangles with indices below vertex_count, of which at most 256 are in use. Triangles
/// keep their winding but may start at another of their corners.
/// @param group_ends ends of groups of triangles, ascending; the last is the number of triangles. Empty: one group. The
/// triangles of a group stay together. The order of groups is free, and strips may continue from one group into the
/// next.
Strips find_strips(std::span<const Triangle> triangles, uint32_t vertex_count,
                   std::span<const uint32_t> group_ends = {});

/// Makes strips without reordering the triangles. A strip ends where the next triangle does not share one of the two
/// edges by which the strip can leave the last triangle. The limits are those of find_strips().
Strips strips_in_order(std::span<const Triangle> triangles, uint32_t vertex_count);

void write_strips(const Strips& strips, BitWriter& writer);

/// Decodes all triangles in order into triangles[0..T) and adds `base` to each index.
void decode_triangles(const uint8_t* bits, const IndexLayout& layout, uint32_t base, std::span<Triangle> triangles);

/// Decodes triangle number `index` alone.
Triangle decode_triangle(const uint8_t* bits, const IndexLayout& layout, uint32_t index);

/// Whether write_strips() could have written these bits: counts match the layout, and every index names an earlier
/// vertex. The behaviour of decode_*() on other bits is undefined.
bool strips_are_valid(const uint8_t* bits, const IndexLayout& layout);

} // namespace packtrace
