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

QTangent encode_q_tangent(const TangentFrame& frame, uint32_t bits) {
  const glm::dmat3 axes(frame.tangent, glm::cross(frame.normal, frame.tangent), frame.normal);
  glm::dquat q = glm::normalize(glm::quat_cast(axes));
  if (q.w < 0.0) q = -q;
  const double most = std::ldexp(1.0, static_cast<int>(bits) - 1) - 1.0;
  const double least = 1.0 / most; // |w| is at least one code, so that its sign is kept
  if (q.w < least) {
    const double scale = std::sqrt(1.0 - least * least) / std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z);
    q = glm::dquat(least, q.x * scale, q.y * scale, q.z * scale);
  }
  if (frame.mirrored) q = -q;
  QTangent code;
  const std::array<double, 4> parts{q.x, q.y, q.z, q.w};
  for (size_t i = 0; i < 4; ++i) code[i] = static_cast<int32_t>(std::llrint(parts[i] * most));
  return code;
}

TangentFrame decode_q_tangent(const QTangent& code, uint32_t bits) {
  const double most = std::ldexp(1.0, static_cast<int>(bits) - 1) - 1.0;
  glm::dquat q(code[3] / most, code[0] / most, code[1] / most, code[2] / most);
  q = glm::dot(q, q) > 0.0 ? glm::normalize(q) : glm::dquat(1.0, 0.0, 0.0, 0.0);
  const glm::dmat3 axes = glm::mat3_cast(q);
  return {axes[2], axes[0], code[3] < 0};
}

} // namespace packtrace
