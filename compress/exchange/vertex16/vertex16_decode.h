#pragma once

// Made by vertex16_generator from vertex16_fields.h; docs/vertex16.md says where the bytes lie.
// clang-format off

#include <glm/glm.hpp>

namespace packtrace::vertex16 {

using glm::abs, glm::max, glm::sqrt;
using glm::ivec2, glm::ivec3, glm::uint, glm::uvec4, glm::vec2, glm::vec3, glm::vec4;

// What a geometry's vertices share: 32 bytes, as std430 and C++ lay them out.
struct Vertex16Frame {
  ivec3 origin;    // lattice coordinates of position 0
  float step;      // object units
  ivec2 uv_origin; // of uv 0, in steps
  vec2 uv_step;    // powers of two
};

static_assert(sizeof(Vertex16Frame) == 32);

// Bits 0 to 20: lattice coordinate, less the geometry's origin.
inline uint vertex16_position_x(uvec4 v) { return v.x & 2097151u; }
// Bits 21 to 41: the same along y.
inline uint vertex16_position_y(uvec4 v) { return ((v.x >> 21u) | (v.y << 11u)) & 2097151u; }
// Bits 42 to 62: the same along z.
inline uint vertex16_position_z(uvec4 v) { return (v.y >> 10u) & 2097151u; }
// Bits 63 to 63: 1: the bitangent is -cross(normal, tangent).
inline uint vertex16_tangent_sign(uvec4 v) { return (v.y >> 31u) & 1u; }
// Bits 64 to 87: axis24 code (docs/baked_format.md); 16777215: flat, the triangle's own normal.
inline uint vertex16_normal(uvec4 v) { return v.z & 16777215u; }
// Bits 88 to 95: diamond angle of the tangent around the normal.
inline uint vertex16_tangent_angle(uvec4 v) { return (v.z >> 24u) & 255u; }
// Bits 96 to 111: texture coordinate in steps, less the geometry's origin.
inline uint vertex16_uv_u(uvec4 v) { return v.w & 65535u; }
// Bits 112 to 127: the same along v.
inline uint vertex16_uv_v(uvec4 v) { return (v.w >> 16u) & 65535u; }
// The vertex of these fields, each within its bits.
inline uvec4 vertex16_pack(uint position_x, uint position_y, uint position_z, uint tangent_sign, uint normal, uint tangent_angle, uint uv_u, uint uv_v) {
  return uvec4(position_x | (position_y << 21u),
               (position_y >> 11u) | (position_z << 10u) | (tangent_sign << 31u),
               normal | (tangent_angle << 24u),
               uv_u | (uv_v << 16u));
}

// Object space. Exact where |origin + field| <= 2^24; the same lattice point is the same float in every geometry.
inline vec3 vertex16_position(uvec4 v, Vertex16Frame frame) {
  ivec3 field = ivec3(int(vertex16_position_x(v)), int(vertex16_position_y(v)), int(vertex16_position_z(v)));
  return vec3(frame.origin + field) * frame.step;
}

// Exact where |uv_origin + field| <= 2^24.
inline vec2 vertex16_uv(uvec4 v, Vertex16Frame frame) {
  ivec2 field = ivec2(int(vertex16_uv_u(v)), int(vertex16_uv_v(v)));
  return vec2(frame.uv_origin + field) * frame.uv_step;
}

// Whether the triangle's own normal counts: cross(p1 - p0, p2 - p0) of its positions.
inline bool vertex16_is_flat(uvec4 v) { return vertex16_normal(v) == 16777215u; }

inline float vertex16_warp(int twice) {
  float t = float(twice) * 0.0005988024f;
  return t * (0.7841797f + -0.0770729f * (t * t));
}

// Unit length, object space; (0, 0, 0) where the vertex is flat.
inline vec3 vertex16_decode_normal(uvec4 v) {
  uint code = vertex16_normal(v);
  if (code == 16777215u) return vec3(0.0f, 0.0f, 0.0f);
  uint column = code / 1671u;
  uint face = column / 1671u; // 2 axis + sign
  float a = vertex16_warp(2 * int(column - face * 1671u) - 1670);
  float b = vertex16_warp(2 * int(code - column * 1671u) - 1670);
  float c = sqrt(max(1.0f - (a * a + b * b), 0.0f));
  c = (face & 1u) != 0u ? -c : c;
  return face < 2u ? vec3(c, a, b) : face < 4u ? vec3(b, c, a) : vec3(a, b, c);
}

// Unit vectors that angle 0 and angle 1/4 point to: an orthonormal basis with the normal (unit length).
// Source: Duff et al., "Building an Orthonormal Basis, Revisited", 2017.
inline vec3 vertex16_basis_x(vec3 n) {
  float s = n.z >= 0.0f ? 1.0f : -1.0f;
  float a = -1.0f / (s + n.z);
  return vec3(1.0f + s * n.x * n.x * a, s * (n.x * n.y * a), -s * n.x);
}
inline vec3 vertex16_basis_y(vec3 n) {
  float s = n.z >= 0.0f ? 1.0f : -1.0f;
  float a = -1.0f / (s + n.z);
  return vec3(n.x * n.y * a, s + n.y * n.y * a, -n.y);
}

// The unit vector of a diamond angle, a place t in 0 .. 4 on the square |x| + |y| = 1.
inline vec2 vertex16_diamond(float t) {
  float side = t < 2.0f ? 1.0f : -1.0f;
  float x = side * (1.0f - (t < 2.0f ? t : t - 2.0f));
  float y = side * (1.0f - abs(x));
  return vec2(x, y) * (1.0f / sqrt(x * x + y * y));
}

// Tangent, unit length and at right angles to the normal, and the sign of the bitangent sign * cross(normal, tangent).
// normal: that of vertex16_decode_normal(). Without meaning unless the draw says that it has tangents.
inline vec4 vertex16_tangent(uvec4 v, vec3 normal) {
  vec2 d = vertex16_diamond(float(vertex16_tangent_angle(v)) * 0.015625f);
  vec3 tangent = vertex16_basis_x(normal) * d.x + vertex16_basis_y(normal) * d.y;
  return vec4(tangent, vertex16_tangent_sign(v) != 0u ? -1.0f : 1.0f);
}

} // namespace packtrace::vertex16
