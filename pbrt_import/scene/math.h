#pragma once

#include <cmath>
#include <optional>

#include <glm/glm.hpp>

namespace packtrace {

using Vec2 = glm::vec2;
using Vec3 = glm::vec3;
using DVec3 = glm::dvec3;
using Triangle = glm::uvec3; ///< three vertex indices

/// Affine maps in GLM's column-major layout of 4 columns x 3 rows: columns 0 to 2 are the linear part, column 3 is the
/// translation. Variables are named target_from_source, such as world_from_object. All spaces are left-handed, as in
/// pbrt (camera: +x right, +y up, +z forward).
using Affine = glm::mat4x3;
using DAffine = glm::dmat4x3;

inline Vec3 transform_point(const Affine& to_from, Vec3 p) { return to_from * glm::vec4(p, 1.0f); }
inline DVec3 transform_point(const DAffine& to_from, DVec3 p) { return to_from * glm::dvec4(p, 1.0); }
inline Vec3 transform_vector(const Affine& to_from, Vec3 v) { return glm::mat3(to_from) * v; }
inline DVec3 transform_vector(const DAffine& to_from, DVec3 v) { return glm::dmat3(to_from) * v; }

/// Matrix that transforms normals by an affine map: the cofactor matrix of the linear part, times the sign of its
/// determinant. This equals |det| times the inverse transpose, but needs no division and works for singular maps;
/// results are not of unit length.
inline glm::dmat3 normal_matrix(const DAffine& to_from) {
  const DVec3 x = to_from[0], y = to_from[1], z = to_from[2];
  const glm::dmat3 cofactor(glm::cross(y, z), glm::cross(z, x), glm::cross(x, y));
  return glm::dot(x, cofactor[0]) < 0.0 ? -cofactor : cofactor;
}

/// True if the map mirrors, that is, if the determinant of its linear part is negative.
inline bool swaps_handedness(const DAffine& to_from) { return glm::determinant(glm::dmat3(to_from)) < 0.0; }

/// a after b: x -> a (b x).
inline DAffine compose(const DAffine& a, const DAffine& b) {
  const glm::dmat3 linear = glm::dmat3(a) * glm::dmat3(b);
  return DAffine(linear[0], linear[1], linear[2], transform_point(a, b[3]));
}

inline DAffine inverse(const DAffine& to_from) {
  const glm::dmat3 linear = glm::inverse(glm::dmat3(to_from));
  return DAffine(linear[0], linear[1], linear[2], -(linear * to_from[3]));
}

inline bool is_finite(Vec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }
inline bool is_finite(DVec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

/// pbrt's LookAt as world_from_camera; nullopt if eye and target coincide or up is parallel to the view direction.
inline std::optional<DAffine> look_at(DVec3 eye, DVec3 target, DVec3 up) {
  const DVec3 view = target - eye;
  if (!(glm::length(view) > 0.0) || !(glm::length(up) > 0.0)) return std::nullopt;
  const DVec3 forward = glm::normalize(view);
  const DVec3 sideways = glm::cross(glm::normalize(up), forward);
  if (!(glm::length(sideways) > 1e-12)) return std::nullopt; // parallel up to the rounding of decimal input
  const DVec3 right = glm::normalize(sideways);
  return DAffine(right, glm::cross(forward, right), forward, eye);
}

} // namespace packtrace
