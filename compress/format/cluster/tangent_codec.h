#pragma once

#include <array>
#include <cstdint>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Tangent that follows from a triangle's positions and texture coordinates.
struct UvTangent {
  DVec3 tangent{0.0};    ///< along dP/du, unit length; 0 if the texture coordinates span no area
  double area = 0.0;     ///< twice the triangle's area
  bool mirrored = false; ///< the winding of the texture coordinates is opposite to that of the positions
};

/// With e_i = p_i - p_0 and d_i = uv_i - uv_0: dP/du = (e_1 d_2.v - e_2 d_1.v) / det, det = d_1.u d_2.v - d_2.u d_1.v.
/// For a vertex normal n the bitangent is +-cross(n, tangent). The sign is minus if exactly one of these holds: the
/// triangle is mirrored; n and cross(e_1, e_2) lie on opposite sides.
UvTangent uv_tangent(const std::array<DVec3, 3>& positions, const std::array<glm::dvec2, 3>& uvs);

/// Encodes a direction in the plane as a place on the square |x| + |y| = 1, in `bits` bits. The code of (1, 0) is 0,
/// that of (0, 1) a quarter of the code range. The largest error is about 2 / 2^bits radians, on the diagonals; the
/// mean is 0.41 times that.
/// @param bits 2..30
/// @param direction any nonzero length
uint32_t encode_diamond(glm::dvec2 direction, uint32_t bits);
glm::dvec2 decode_diamond(uint32_t code, uint32_t bits); ///< unit length

} // namespace packtrace
