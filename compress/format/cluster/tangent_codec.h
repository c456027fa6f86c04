#pragma once

#include <array>
#include <cstdint>

#include <glm/gtc/quaternion.hpp>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// What a triangle's texture coordinates say of tangents without anything stored.
struct UvTangent {
  DVec3 tangent{0.0};    ///< along dP/du, unit length; 0 where the coordinates span no area
  double area = 0.0;     ///< twice the triangle's
  bool mirrored = false; ///< texture coordinates run the other way round than positions
};

/// With e_i = p_i - p_0 and d_i = uv_i - uv_0: dP/du = (e_1 d_2.v - e_2 d_1.v) / det, det = d_1.u d_2.v - d_2.u d_1.v.
/// For a normal n the bitangent is +-cross(n, tangent): minus where exactly one holds of mirrored and that n lies on
/// the other side than cross(e_1, e_2).
UvTangent uv_tangent(const std::array<DVec3, 3>& positions, const std::array<glm::dvec2, 3>& uvs);

/// A direction in the plane as a place on the square |x| + |y| = 1, in `bits` bits; the code of (1, 0) is 0, that of
/// (0, 1) a quarter of all. The largest error is about 2 / 2^bits radians, on the diagonals, the mean .41 of that.
/// @param bits 2..30
/// @param direction of any length but 0
uint32_t encode_diamond(glm::dvec2 direction, uint32_t bits);
glm::dvec2 decode_diamond(uint32_t code, uint32_t bits); ///< unit length

/// Normal, tangent and the bitangent's sign as one unit quaternion, whose w is negative where the sign is: it turns x
/// into the tangent and z into the normal. Each component has `bits` bits, signed. Source: Frey, Herzeg, "Spherical
/// Skinning with Dual Quaternions and QTangents", 2011.
struct TangentFrame {
  DVec3 normal{0.0, 0.0, 1.0};  ///< unit length
  DVec3 tangent{1.0, 0.0, 0.0}; ///< unit length, at right angles to the normal
  bool mirrored = false;
};
using QTangent = std::array<int32_t, 4>; ///< x, y, z, w
/// @param bits 4..24 a component
QTangent encode_q_tangent(const TangentFrame& frame, uint32_t bits);
TangentFrame decode_q_tangent(const QTangent& code, uint32_t bits);

} // namespace packtrace
