#include "pbrt_import/mesh_files/polygon.h"

#include <cmath>
#include <numeric>

namespace packtrace {
namespace {

using Triples = std::vector<std::array<uint32_t, 3>>;

void add_fan(uint32_t corners, uint32_t first, Triples& triangles) {
  for (uint32_t i = 1; i + 1 < corners; ++i)
    triangles.push_back({first, (first + i) % corners, (first + i + 1) % corners});
}

/// Twice the area vector of a polygon.
/// Source: I. Sutherland et al., A characterization of ten hidden-surface algorithms, 1974 (Newell's method).
DVec3 area_vector(std::span<const Vec3> corners) {
  DVec3 sum(0.0);
  for (size_t i = 1; i + 1 < corners.size(); ++i)
    sum += glm::cross(DVec3(corners[i]) - DVec3(corners[0]), DVec3(corners[i + 1]) - DVec3(corners[0]));
  return sum;
}

/// A polygon in the plane in which its area is largest.
class FlatPolygon {
public:
  FlatPolygon(std::span<const Vec3> corners, DVec3 normal) {
    const DVec3 size = glm::abs(normal);
    const int drop = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const int u = (drop + 1) % 3, v = (drop + 2) % 3;
    const double sign = normal[drop] < 0.0 ? -1.0 : 1.0;
    points_.reserve(corners.size());
    for (const Vec3& corner : corners) points_.emplace_back(corner[u], corner[v] * sign);
  }

  /// Twice the signed area of a triangle; positive if it turns as the polygon does.
  double turn(uint32_t a, uint32_t b, uint32_t c) const {
    const glm::dvec2 ab = points_[b] - points_[a], ac = points_[c] - points_[a];
    return ab.x * ac.y - ab.y * ac.x;
  }
  bool contains(uint32_t a, uint32_t b, uint32_t c, uint32_t point) const {
    return turn(a, b, point) >= 0.0 && turn(b, c, point) >= 0.0 && turn(c, a, point) >= 0.0;
  }
  bool same_place(uint32_t a, uint32_t b) const { return points_[a] == points_[b]; }

private:
  std::vector<glm::dvec2> points_;
};

/// Whether the triangle at position i of the remaining corners can be cut off.
bool is_ear(const FlatPolygon& polygon, std::span<const uint32_t> left, size_t i) {
  const uint32_t a = left[(i + left.size() - 1) % left.size()], b = left[i], c = left[(i + 1) % left.size()];
  if (polygon.turn(a, b, c) <= 0.0) return false;
  for (const uint32_t other : left) {
    if (other == a || other == b || other == c) continue;
    if (polygon.same_place(other, a) || polygon.same_place(other, b) || polygon.same_place(other, c)) continue;
    if (polygon.contains(a, b, c, other)) return false;
  }
  return true;
}

void cut_ears(const FlatPolygon& polygon, uint32_t corners, Triples& triangles) {
  std::vector<uint32_t> left(corners);
  std::iota(left.begin(), left.end(), 0u);
  size_t i = 1, tried = 0;
  while (left.size() > 3) {
    const size_t at = i % left.size();
    // Without an ear the polygon crosses itself or has no area left, so any corner may be cut.
    if (tried < left.size() && !is_ear(polygon, left, at)) {
      ++i, ++tried;
      continue;
    }
    triangles.push_back({left[(at + left.size() - 1) % left.size()], left[at], left[(at + 1) % left.size()]});
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(at));
    i = at, tried = 0;
  }
  triangles.push_back({left[0], left[1], left[2]});
}

} // namespace

void triangulate_polygon(std::span<const Vec3> corners, Triples& triangles) {
  const auto count = static_cast<uint32_t>(corners.size());
  if (count == 3) return triangles.push_back({0, 1, 2});
  const DVec3 normal = area_vector(corners);
  const double area = glm::length(normal);
  if (!(area > 0.0) || !std::isfinite(area) || count > kMaxEarCorners) return add_fan(count, 0, triangles);
  const FlatPolygon polygon(corners, normal);
  if (count == 4) // a fan from corner 1 if the diagonal from corner 0 leaves the polygon
    return add_fan(count, polygon.turn(0, 1, 2) < 0.0 || polygon.turn(0, 2, 3) < 0.0 ? 1 : 0, triangles);
  cut_ears(polygon, count, triangles);
}

} // namespace packtrace
