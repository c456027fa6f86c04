#include "compress/bake/lod/triangle_distance.h"

#include <algorithm>

namespace packtrace {

DVec3 nearest_point(DVec3 p, DVec3 a, DVec3 b) {
  const DVec3 d = b - a;
  const double length2 = glm::dot(d, d);
  const double t = length2 > 0.0 ? std::clamp(glm::dot(p - a, d) / length2, 0.0, 1.0) : 0.0;
  return a + t * d;
}

DVec3 nearest_point(DVec3 p, DVec3 a, DVec3 b, DVec3 c) {
  const DVec3 n = glm::cross(b - a, c - a);
  const double n2 = glm::dot(n, n);
  if (n2 > 0.0) {
    const bool inside = glm::dot(glm::cross(b - a, p - a), n) >= 0.0 && glm::dot(glm::cross(c - b, p - b), n) >= 0.0 &&
                        glm::dot(glm::cross(a - c, p - c), n) >= 0.0;
    if (inside) return p - n * (glm::dot(p - a, n) / n2);
  }
  const DVec3 q[3] = {nearest_point(p, a, b), nearest_point(p, b, c), nearest_point(p, c, a)};
  const auto distance2 = [&](DVec3 r) { return glm::dot(r - p, r - p); };
  return *std::min_element(q, q + 3, [&](DVec3 r, DVec3 s) { return distance2(r) < distance2(s); });
}

} // namespace packtrace
