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
  // Most maps are far from flattening, which cofactors show without a division or root: the condition number is the
  // product of the norms of the map and of its cofactors, over the determinant. The margin covers rounding.
  const DVec3 x = linear[0], y = linear[1], z = linear[2], yz = glm::cross(y, z), zx = glm::cross(z, x),
              xy = glm::cross(x, y);
  const double square = glm::dot(x, x) + glm::dot(y, y) + glm::dot(z, z), determinant = glm::dot(x, yz);
  const double cofactors = glm::dot(yz, yz) + glm::dot(zx, zx) + glm::dot(xy, xy);
  constexpr double kSmall = 1e-60, kLarge = 1e60;
  if (square > kSmall && square < kLarge && square * cofactors < 0x1p40 * determinant * determinant) return false;
  const glm::dmat3 unit = linear / norm(linear);
  return !(norm(unit) * norm(glm::inverse(unit)) < 0x1p22);
}

} // namespace packtrace
