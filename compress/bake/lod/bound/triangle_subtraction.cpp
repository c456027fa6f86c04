#include "compress/bake/lod/bound/triangle_subtraction.h"

#include <algorithm>
#include <cmath>

#include "compress/bake/lod/bound/triangle_distance.h"

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

TriangleSubtraction::Polygon TriangleSubtraction::split(const Polygon& polygon, const Prism& prism) {
  Polygon inside = polygon;
  for (size_t side = 0; side < 3 && inside.count >= 3; ++side) {
    if (inside.count + 1 > inside.corners.size()) return {};
    Polygon in, out;
    DVec3 last = inside.corners[inside.count - 1];
    double last_height = glm::dot(prism.inwards[side], last) - prism.limits[side];
    for (uint32_t i = 0; i < inside.count; ++i) {
      const DVec3 next = inside.corners[i];
      const double height = glm::dot(prism.inwards[side], next) - prism.limits[side];
      if ((last_height < 0.0) != (height < 0.0)) {
        const DVec3 between = last + last_height / (last_height - height) * (next - last);
        in.add(between), out.add(between);
      }
      (height < 0.0 ? out : in).add(next);
      last = next, last_height = height;
    }
    if (out.count >= 3) next_.push_back(out);
    inside = in;
  }
  return inside;
}

double TriangleSubtraction::distance(const Polygon& polygon, const std::array<DVec3, 3>& triangle) {
  double largest2 = 0.0;
  for (uint32_t i = 0; i < polygon.count; ++i) {
    const DVec3 d = polygon.corners[i] - nearest_point(polygon.corners[i], triangle[0], triangle[1], triangle[2]);
    largest2 = std::max(largest2, glm::dot(d, d));
  }
  return std::sqrt(largest2);
}

} // namespace packtrace
