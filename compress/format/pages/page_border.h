#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "compress/format/cluster/normal_codec.h"
#include "compress/format/cluster/position_grid.h"

namespace packtrace {

inline constexpr uint32_t kNoPagePoint = ~0u;

/// Border edges at a point, newest first. Two surfaces that touch in a point have one each; kNoPagePoint marks unused
/// entries.
struct BorderEnds {
  std::array<uint32_t, 2> points{kNoPagePoint, kNoPagePoint};

  uint32_t operator[](size_t i) const { return points[i]; }
  bool has(uint32_t point) const { return (int{points[0] == point} | int{points[1] == point}) != 0; }
  /// Adds an edge and drops the older of two.
  void push(uint32_t point) { points = {point, points[0]}; }
  void erase(size_t at) { points = {at == 0 ? points[1] : points[0], kNoPagePoint}; }
  /// Newest entry that differs from `other_than`.
  uint32_t pick(uint32_t other_than) const { return points[0] != other_than ? points[0] : points[1]; }
};

/// A distinct vertex position of a page, and the border of the triangles coded so far there.
struct PagePoint {
  LatticePoint position;
  BorderEnds next;                     ///< end points of border edges that begin here, newest first
  BorderEnds previous;                 ///< start points of border edges that end here, newest first
  BorderEnds apex;                     ///< third corners of the triangles at the edges to `next`
  uint32_t cluster = 0;                ///< last cluster with a vertex here
  uint16_t vertex = 0;                 ///< newest vertex of that cluster here
  uint16_t normal_count = 0;           ///< 0..2
  std::array<NormalFields, 2> normals; ///< the last two different normals, newest first
  Vec3 unit_normal{0.0f};              ///< the newest, decoded
};

/// Adds a triangle to the border: its edges close edges of the border or become part of it.
/// @param triangle indices of its points
inline void close_edges(std::vector<PagePoint>& points, const std::array<uint32_t, 3>& triangle) {
  for (uint32_t i = 0; i < 3; ++i) {
    const uint32_t from = triangle[i], to = triangle[(i + 1) % 3];
    PagePoint &a = points[from], &b = points[to];
    if (a.previous.has(to) && b.next.has(from)) {
      const size_t out = b.next[0] == from ? 0 : 1;
      a.previous.erase(a.previous[0] == to ? 0 : 1), b.next.erase(out), b.apex.erase(out);
    } else {
      a.next.push(to), a.apex.push(triangle[(i + 2) % 3]), b.previous.push(from);
    }
  }
}

} // namespace packtrace
