#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include <glm/gtc/quaternion.hpp>

#include "pbrt_import/scene/math.h"

// An encoding of tangent frames that no file has; benchmarks compare the others with it.
namespace packtrace::test {

/// Normal, tangent and the sign of the bitangent as one unit quaternion. It rotates x to the tangent and z to the
/// normal; w is negative if the bitangent's sign is. Each component is a signed number of `bits` bits. Source: Frey,
/// Herzeg, "Spherical Skinning with Dual Quaternions and QTangents", 2011.
struct TangentFrame {
  DVec3 normal{0.0, 0.0, 1.0};  ///< unit length
  DVec3 tangent{1.0, 0.0, 0.0}; ///< unit length, orthogonal to the normal
  bool mirrored = false;
};
using QTangent = std::array<int32_t, 4>; ///< x, y, z, w

/// @param bits 4..24 per component
inline QTangent encode_q_tangent(const TangentFrame& frame, uint32_t bits) {
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

inline TangentFrame decode_q_tangent(const QTangent& code, uint32_t bits) {
  const double most = std::ldexp(1.0, static_cast<int>(bits) - 1) - 1.0;
  glm::dquat q(code[3] / most, code[0] / most, code[1] / most, code[2] / most);
  q = glm::dot(q, q) > 0.0 ? glm::normalize(q) : glm::dquat(1.0, 0.0, 0.0, 0.0);
  const glm::dmat3 axes = glm::mat3_cast(q);
  return {axes[2], axes[0], code[3] < 0};
}

} // namespace packtrace::test
