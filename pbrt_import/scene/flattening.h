#pragma once

#include <cmath>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Whether a map flattens space to a plane, a line or a point as far as 32-bit floats can tell: its condition number,
/// with Frobenius norms, is not below 2^22, or it has no inverse. A uniform scale does not flatten.
inline bool flattens(const DAffine& to_from) {
  const auto norm = [](const glm::dmat3& m) {
    return std::sqrt(glm::dot(m[0], m[0]) + glm::dot(m[1], m[1]) + glm::dot(m[2], m[2]));
  };
  const glm::dmat3 linear(to_from);
  const glm::dmat3 unit = linear / norm(linear);
  return !(norm(unit) * norm(glm::inverse(unit)) < 0x1p22);
}

} // namespace packtrace
