#include "compress/exchange/gltf/gltf_instances.h"

#include <algorithm>
#include <cmath>

#include <glm/gtc/quaternion.hpp>

namespace packtrace {

std::optional<InstanceTransform> decompose(const Affine& map) {
  glm::dmat3 linear = glm::dmat3(glm::mat3(map));
  DVec3 scale(glm::length(linear[0]), glm::length(linear[1]), glm::length(linear[2]));
  if (!(scale.x > 0.0 && scale.y > 0.0 && scale.z > 0.0)) return std::nullopt;
  if (glm::determinant(linear) < 0.0) scale.x = -scale.x;
  glm::dmat3 turn(linear[0] / scale.x, linear[1] / scale.y, linear[2] / scale.z);
  const glm::dquat q = glm::normalize(glm::quat_cast(turn));
  InstanceTransform result;
  for (int i = 0; i < 3; ++i) {
    result.translation[static_cast<size_t>(i)] = map[3][i];
    result.scale[static_cast<size_t>(i)] = static_cast<float>(scale[i]);
  }
  result.rotation = {static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z),
                     static_cast<float>(q.w)};
  const glm::dmat3 again = glm::mat3_cast(glm::normalize(glm::dquat(
      double{result.rotation[3]}, double{result.rotation[0]}, double{result.rotation[1]}, double{result.rotation[2]})));
  double error = 0.0, size = 0.0;
  for (int c = 0; c < 3; ++c) {
    error = std::max(error, glm::length(again[c] * double{result.scale[static_cast<size_t>(c)]} - linear[c]));
    size = std::max(size, glm::length(linear[c]));
  }
  constexpr double kTolerance = 4e-6;
  return error <= kTolerance * size ? std::optional(result) : std::nullopt;
}

} // namespace packtrace
