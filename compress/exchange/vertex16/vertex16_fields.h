#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace packtrace {

/// A bit field of the 16-byte vertex. The fields are consecutive, from bit 0 of the first of four 32-bit words.
struct Vertex16Field {
  std::string_view name;
  uint32_t bits;
  std::string_view meaning;
};

/// The only definition of the 16-byte vertex. vertex16_generator writes the C++ and GLSL accessors from it, and
/// docs/vertex16.md repeats it; tests compare all three.
inline constexpr std::array<Vertex16Field, 8> kVertex16Fields{{
    {"position_x", 21, "lattice coordinate, less the geometry's origin"},
    {"position_y", 21, "the same along y"},
    {"position_z", 21, "the same along z"},
    {"tangent_sign", 1, "1: the bitangent is -cross(normal, tangent)"},
    {"normal", 24, "axis24 code (docs/baked_format.md); 16777215: flat, the triangle's own normal"},
    {"tangent_angle", 8, "diamond angle of the tangent around the normal"},
    {"uv_u", 16, "texture coordinate in steps, less the geometry's origin"},
    {"uv_v", 16, "the same along v"},
}};

constexpr uint32_t vertex16_bits() {
  uint32_t bits = 0;
  for (const Vertex16Field& field : kVertex16Fields) bits += field.bits;
  return bits;
}
static_assert(vertex16_bits() == 128);

inline constexpr uint32_t kVertex16FlatNormal = (1u << 24) - 1;

} // namespace packtrace
