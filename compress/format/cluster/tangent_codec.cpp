#include "compress/format/cluster/tangent_codec.h"

#include <algorithm>
#include <cmath>

namespace packtrace {

UvTangent uv_tangent(const std::array<DVec3, 3>& positions, const std::array<glm::dvec2, 3>& uvs) {
  const DVec3 e1 = positions[1] - positions[0], e2 = positions[2] - positions[0];
  const glm::dvec2 d1 = uvs[1] - uvs[0], d2 = uvs[2] - uvs[0];
  const double determinant = d1.x * d2.y - d2.x * d1.y;
  UvTangent result;
  result.area = glm::length(glm::cross(e1, e2));
  result.mirrored = determinant < 0.0;
  const DVec3 along = (e1 * d2.y - e2 * d1.y) * (result.mirrored ? -1.0 : 1.0);
  const double length = glm::length(along);
  if (determinant != 0.0 && length > 0.0) result.tangent = along / length;
  return result;
}

uint32_t encode_diamond(glm::dvec2 direction, uint32_t bits) {
  const double along = direction.x / (std::abs(direction.x) + std::abs(direction.y));
  const double quarters = direction.y >= 0.0 ? 1.0 - along : 3.0 + along;
  return static_cast<uint32_t>(std::llrint(std::ldexp(quarters, static_cast<int>(bits) - 2))) & ((1u << bits) - 1);
}

glm::dvec2 decode_diamond(uint32_t code, uint32_t bits) {
  const double quarters = std::ldexp(static_cast<double>(code), 2 - static_cast<int>(bits));
  const double side = quarters < 2.0 ? 1.0 : -1.0;
  const double x = side * (1.0 - (quarters < 2.0 ? quarters : quarters - 2.0));
  return glm::normalize(glm::dvec2(x, side * (1.0 - std::abs(x))));
}

} // namespace packtrace
