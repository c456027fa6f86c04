#pragma once

#include <algorithm>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// The point of the segment (a, b) nearest to p.
inline DVec3 nearest_point(const DVec3& p, const DVec3& a, const DVec3& b) {
  const DVec3 d = b - a;
  const double length2 = glm::dot(d, d);
  const double t = length2 > 0.0 ? std::clamp(glm::dot(p - a, d) / length2, 0.0, 1.0) : 0.0;
  return a + t * d;
}

/// The point of the triangle (a, b, c) nearest to p. Degenerate triangles count as segments.
inline DVec3 nearest_point(const DVec3& p, const DVec3& a, const DVec3& b, const DVec3& c) {
  // Projects p to the plane as a + v (b - a) + w (c - a), scaled by area2. If the projection is inside the triangle, it
  // is the nearest point; otherwise the nearest point is on a side that p lies beyond.
  const DVec3 ab = b - a, ac = c - a, ap = p - a;
  const double d00 = glm::dot(ab, ab), d01 = glm::dot(ab, ac), d11 = glm::dot(ac, ac);
  const double p0 = glm::dot(ap, ab), p1 = glm::dot(ap, ac);
  const double area2 = d00 * d11 - d01 * d01;
  const double v = d11 * p0 - d01 * p1, w = d00 * p1 - d01 * p0;
  if (area2 > 1e-12 * d00 * d11) {
    if (v >= 0.0 && w >= 0.0 && v + w <= area2) return a + (v / area2) * ab + (w / area2) * ac;
    // p lies beyond one side only, so the nearest point is on it.
    if (v >= 0.0 && w >= 0.0) return nearest_point(p, b, c);
    if (v >= 0.0 && v + w <= area2) return nearest_point(p, a, b);
    if (w >= 0.0 && v + w <= area2) return nearest_point(p, a, c);
  }
  const DVec3 q[3] = {nearest_point(p, a, b), nearest_point(p, b, c), nearest_point(p, c, a)};
  const auto distance2 = [&](const DVec3& r) { return glm::dot(r - p, r - p); };
  return *std::min_element(q, q + 3, [&](const DVec3& r, const DVec3& s) { return distance2(r) < distance2(s); });
}

} // namespace packtrace
