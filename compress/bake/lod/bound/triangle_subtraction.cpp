#include "compress/bake/lod/bound/triangle_subtraction.h"

#include <limits>
#include <tuple>

namespace packtrace {

void TriangleSubtraction::begin(const std::array<DVec3, 3>& triangle) {
  Polygon whole;
  for (const DVec3& p : triangle) whole.add(p);
  rest_.assign(1, whole);
}

bool TriangleSubtraction::Prism::set(const std::array<DVec3, 3>& triangle) {
  normal = glm::cross(triangle[1] - triangle[0], triangle[2] - triangle[0]);
  const double area = glm::length(normal);
  if (!(area > 0.0)) return false;
  normal /= area;
  offset = glm::dot(normal, triangle[0]);
  for (size_t i = 0; i < 3; ++i) {
    inwards[i] = glm::cross(normal, triangle[(i + 1) % 3] - triangle[i]);
    limits[i] = glm::dot(inwards[i], triangle[i]);
  }
  return true;
}

double TriangleSubtraction::Prism::largest_height(const Polygon& polygon) const {
  double largest = 0.0;
  for (uint32_t i = 0; i < polygon.count; ++i)
    largest = std::max(largest, std::abs(glm::dot(normal, polygon.corners[i]) - offset));
  return largest;
}

double TriangleSubtraction::Prism::least_height(const Polygon& polygon) const {
  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
  for (uint32_t i = 0; i < polygon.count; ++i) {
    const double height = glm::dot(normal, polygon.corners[i]) - offset;
    lowest = std::min(lowest, height), highest = std::max(highest, height);
  }
  return std::max({lowest, -highest, 0.0});
}

bool TriangleSubtraction::Prism::is_beyond_a_side(const Polygon& polygon) const {
  for (size_t side = 0; side < 3; ++side) {
    uint32_t i = 0;
    while (i < polygon.count && glm::dot(inwards[side], polygon.corners[i]) - limits[side] < 0.0) ++i;
    if (i == polygon.count) return true;
  }
  return false;
}

/// The other end of the cut is the corner or the middle of a side that is half way around the polygon.
std::pair<TriangleSubtraction::Polygon, TriangleSubtraction::Polygon>
TriangleSubtraction::halves(const Polygon& polygon) {
  const uint32_t count = polygon.count;
  const auto at = [&](uint32_t i) { return polygon.corners[i % count]; };
  uint32_t longest = 0;
  double length = -1.0;
  for (uint32_t i = 0; i < count; ++i)
    if (const double next = glm::length(at(i + 1) - at(i)); next > length) length = next, longest = i;
  const DVec3 middle = 0.5 * (at(longest) + at(longest + 1));
  // The corners after the longest side are numbered longest + 1 to longest + count.
  const uint32_t half = longest + 1 + count / 2;
  const bool at_corner = count % 2 == 1;
  const DVec3 opposite = at_corner ? at(half) : 0.5 * (at(half - 1) + at(half));
  Polygon one, other;
  one.add(middle);
  for (uint32_t i = longest + 1; i < half; ++i) one.add(at(i));
  one.add(opposite);
  other.add(opposite);
  for (uint32_t i = half + (at_corner ? 1 : 0); i <= longest + count; ++i) other.add(at(i));
  other.add(middle);
  return {one, other};
}

TriangleSubtraction::Polygon TriangleSubtraction::split(const Polygon& polygon, const Prism& prism) {
  Polygon inside = polygon;
  std::array<double, std::tuple_size_v<decltype(Polygon::corners)>> heights;
  for (size_t side = 0; side < 3 && inside.count >= 3; ++side) {
    if (inside.count + 1 > inside.corners.size()) return {};
    bool is_cut = false;
    for (uint32_t i = 0; i < inside.count; ++i) {
      heights[i] = glm::dot(prism.inwards[side], inside.corners[i]) - prism.limits[side];
      is_cut |= heights[i] < 0.0;
    }
    if (!is_cut) continue;
    Polygon in, out;
    for (uint32_t i = 0, k = inside.count - 1; i < inside.count; k = i++) {
      const DVec3 &last = inside.corners[k], &next = inside.corners[i];
      if ((heights[k] < 0.0) != (heights[i] < 0.0)) {
        const DVec3 between = last + heights[k] / (heights[k] - heights[i]) * (next - last);
        in.add(between), out.add(between);
      }
      (heights[i] < 0.0 ? out : in).add(next);
    }
    if (out.count >= 3) next_.push_back(out);
    inside = in;
  }
  return inside;
}

} // namespace packtrace
