#pragma once

#include <cmath>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// How a linear map changes volumes and lengths.
struct LinearExtent {
  explicit LinearExtent(const glm::dmat3& linear) {
    const DVec3 x = linear[0], y = linear[1], z = linear[2], yz = glm::cross(y, z), zx = glm::cross(z, x),
                xy = glm::cross(x, y);
    square = glm::dot(x, x) + glm::dot(y, y) + glm::dot(z, z);
    cofactors = glm::dot(yz, yz) + glm::dot(zx, zx) + glm::dot(xy, xy);
    determinant = glm::dot(x, yz);
  }
  /// A fast sufficient test: if it is true, flattens() is false. The condition number is the norm of the map times the
  /// norm of its cofactor matrix, divided by the determinant; squares need neither a division nor a root. The bound
  /// leaves a margin for rounding.
  bool far_from_flat() const {
    constexpr double kSmall = 1e-60, kLarge = 1e60;
    return square > kSmall && square < kLarge && square * cofactors < 0x1p40 * determinant * determinant;
  }

  double square;    ///< squared Frobenius norm
  double cofactors; ///< squared Frobenius norm of the cofactor matrix
  double determinant;
};

/// A fast sufficient test: if it is true, an affine map with this linear part and a finite translation has an inverse
/// and does not flatten.
inline bool is_sound(const glm::dmat3& linear) {
  const LinearExtent extent(linear);
  return extent.far_from_flat() && std::abs(extent.determinant) > 1e-85;
}

/// Whether a map flattens space to a plane, a line or a point as far as 32-bit floats can tell: its condition number,
/// with Frobenius norms, is not below 2^22, or it has no inverse. A uniform scale does not flatten.
inline bool flattens(const DAffine& to_from) {
  const auto norm = [](const glm::dmat3& m) {
    return std::sqrt(glm::dot(m[0], m[0]) + glm::dot(m[1], m[1]) + glm::dot(m[2], m[2]));
  };
  const glm::dmat3 linear(to_from);
  if (LinearExtent(linear).far_from_flat()) return false;
  const glm::dmat3 unit = linear / norm(linear);
  return !(norm(unit) * norm(glm::inverse(unit)) < 0x1p22);
}

} // namespace packtrace
