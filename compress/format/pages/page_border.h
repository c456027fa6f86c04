#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "compress/format/cluster/normal_codec.h"
#include "compress/format/cluster/position_grid.h"

namespace packtrace {

inline constexpr uint32_t kNoPagePoint = ~0u;
inline constexpr uint32_t kNoPageCorner = ~0u;

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

/// A distinct vertex position of a page, and the border of the triangles coded so far there. A cache line.
struct alignas(64) PagePoint {
  LatticePoint position{};
  BorderEnds next;                     ///< end points of border edges that begin here, newest first
  BorderEnds previous;                 ///< start points of border edges that end here, newest first
  BorderEnds apex;                     ///< corners that face the edges to `next`
  uint32_t cluster = 0;                ///< last cluster with a vertex here
  uint16_t vertex = 0;                 ///< newest vertex of that cluster here
  uint8_t triangles = 0;               ///< triangles here so far, at most kMaxCountedTriangles
  std::array<uint8_t, 3> error_bits{}; ///< bit widths of the position's coded errors
};
static_assert(sizeof(PagePoint) == 64);

/// The normals at a point.
struct PagePointNormals {
  uint32_t count = 0;                 ///< 0..2
  std::array<NormalFields, 2> last{}; ///< the last two different normals, newest first
  Vec3 unit_normal{0.0f};             ///< the newest, decoded
};
inline constexpr uint8_t kMaxCountedTriangles = 7;

/// The triangles of a page. Corner 3t + i is corner i of triangle t.
struct PageTriangles {
  std::vector<uint32_t> points; ///< point of each corner
  std::vector<uint32_t> across; ///< corner that faces the same edge from the other side, or kNoPageCorner

  static constexpr uint32_t next(uint32_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }
  static constexpr uint32_t previous(uint32_t corner) { return corner % 3 == 0 ? corner + 2 : corner - 1; }
  uint32_t count() const { return count_; }

  void clear() { count_ = 0; }

  /// Adds a triangle whose edges have no corners across yet. Returns its first corner.
  uint32_t add(const std::array<uint32_t, 3>& corners) {
    const uint32_t first = count_;
    count_ += 3;
    if (count_ > points.size()) points.resize(2 * size_t{count_}), across.resize(2 * size_t{count_});
    for (uint32_t i = 0; i < 3; ++i) points[first + i] = corners[i], across[first + i] = kNoPageCorner;
    return first;
  }

private:
  uint32_t count_ = 0; // number of corners; the vectors may be longer
};

/// Adds a triangle to the page and to its border: edges close edges of the border or become part of it.
/// @param corners indices of its points
inline void add_triangle(std::vector<PagePoint>& points, PageTriangles& triangles,
                         const std::array<uint32_t, 3>& corners) {
  const uint32_t first = triangles.add(corners);
  for (uint32_t i = 0; i < 3; ++i) {
    const uint32_t from = corners[i], to = corners[(i + 1) % 3], facing = first + (i + 2) % 3;
    PagePoint &a = points[from], &b = points[to];
    a.triangles = static_cast<uint8_t>(a.triangles + (a.triangles < kMaxCountedTriangles ? 1 : 0));
    if (a.previous.has(to) && b.next.has(from)) {
      const size_t out = b.next[0] == from ? 0 : 1;
      triangles.across[facing] = b.apex[out];
      triangles.across[b.apex[out]] = facing;
      a.previous.erase(a.previous[0] == to ? 0 : 1), b.next.erase(out), b.apex.erase(out);
    } else {
      a.next.push(to), a.apex.push(facing), b.previous.push(from);
    }
  }
}

/// Vector between two points in lattice steps; a difference of more than 63 bits wraps.
inline DVec3 steps_between(const LatticePoint& from, const LatticePoint& to) {
  DVec3 steps;
  for (size_t axis = 0; axis < 3; ++axis)
    steps[static_cast<int>(axis)] =
        static_cast<double>(static_cast<int64_t>(static_cast<uint64_t>(to[axis]) - static_cast<uint64_t>(from[axis])));
  return steps;
}

} // namespace packtrace
