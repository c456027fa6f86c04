#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/lod/simplify/simplify.h"

namespace packtrace {

/// Lists the triangle corners at each point while points are merged and triangles removed. Corner i of triangle t has
/// the number 4 t + i.
class CornerLists {
public:
  static constexpr uint32_t kNone = ~0u;

  CornerLists(std::span<const LodTriangle> triangles, size_t point_count)
      : points_(4 * triangles.size()), next_(4 * triangles.size(), kNone), first_(point_count, kNone),
        last_(point_count, kNone) {
    for (uint32_t t = 0; t < triangles.size(); ++t)
      for (uint32_t corner = 4 * t, i = 0; i < 3; ++corner, ++i) {
        const uint32_t point = points_[corner] = triangles[t].points[static_cast<int>(i)];
        (first_[point] == kNone ? first_[point] : next_[last_[point]]) = corner;
        last_[point] = corner;
      }
  }

  uint32_t point(uint32_t corner) const { return points_[corner]; }
  static uint32_t next_corner(uint32_t corner) { return (corner & ~3u) | (9u >> (2 * (corner & 3u)) & 3u); }
  static uint32_t last_corner(uint32_t corner) { return (corner & ~3u) | (18u >> (2 * (corner & 3u)) & 3u); }

  bool alive(uint32_t triangle) const { return points_[4 * triangle + 3] == 0; }
  void remove(uint32_t triangle) { points_[4 * triangle + 3] = 1; }

  /// Calls visit(corner) for each corner at the point and unlinks corners of removed triangles.
  template <typename Visit>
  void for_each(uint32_t point, const Visit& visit) {
    uint32_t* link = &first_[point];
    uint32_t last = kNone;
    for (uint32_t corner = *link; corner != kNone; corner = *link)
      if (alive(corner / 4)) {
        last = corner, link = &next_[corner];
        visit(corner);
      } else {
        *link = next_[corner];
      }
    last_[point] = last;
  }

  /// Appends all corners at `gone` to those at `kept`. Corners of removed triangles may be among them until the next
  /// for_each().
  void move_all(uint32_t gone, uint32_t kept) {
    if (first_[gone] == kNone) return;
    for (uint32_t corner = first_[gone]; corner != kNone; corner = next_[corner]) points_[corner] = kept;
    (first_[kept] == kNone ? first_[kept] : next_[last_[kept]]) = first_[gone];
    last_[kept] = last_[gone];
    first_[gone] = kNone;
  }

private:
  std::vector<uint32_t> points_; ///< per corner; the fourth entry of a triangle is 1 once it is removed
  std::vector<uint32_t> next_;
  std::vector<uint32_t> first_, last_; ///< per point
};

} // namespace packtrace
