#include "compress/exchange/vertex16/vertex16_generator.h"

#include <array>
#include <charconv>
#include <cstdint>
#include <string_view>

#include "compress/exchange/vertex16/vertex16_fields.h"
#include "compress/format/cluster/normal_codec.h"

namespace packtrace {
namespace {

/// Shortest literal that reads back as the same float in both languages.
std::string literal(float value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  std::string result(text.data(), end);
  if (result.find_first_of(".e") == std::string::npos) result += ".0";
  return result + "f";
}

std::string number(uint32_t value) { return std::to_string(value) + "u"; }

std::string mask_of(uint32_t bits) { return number(static_cast<uint32_t>((uint64_t{1} << bits) - 1)); }

std::string_view word(uint32_t bit) {
  static constexpr std::array<std::string_view, 4> kWords{"v.x", "v.y", "v.z", "v.w"};
  return kWords[bit / 32];
}

std::string field_readers(const std::string& prefix) {
  std::string text;
  uint32_t bit = 0;
  for (const Vertex16Field& field : kVertex16Fields) {
    const uint32_t shift = bit % 32, last = bit + field.bits - 1;
    std::string value(word(bit));
    if (shift != 0) value = "(" + value + " >> " + number(shift) + ")";
    if (last / 32 != bit / 32)
      value = "(" + value + " | (" + std::string(word(last)) + " << " + number(32 - shift) + "))";
    text +=
        "// Bits " + std::to_string(bit) + " to " + std::to_string(last) + ": " + std::string(field.meaning) + ".\n";
    text += prefix + "uint vertex16_" + std::string(field.name) + "(uvec4 v) { return " + value + " & " +
            mask_of(field.bits) + "; }\n";
    bit += field.bits;
  }
  return text;
}

std::string packer(const std::string& prefix) {
  std::array<std::string, 4> words;
  std::string parameters;
  uint32_t bit = 0;
  for (const Vertex16Field& field : kVertex16Fields) {
    const std::string name(field.name);
    parameters += (parameters.empty() ? "uint " : ", uint ") + name;
    const auto add = [&](size_t index, const std::string& value) {
      words[index] += (words[index].empty() ? "" : " | ") + value;
    };
    const uint32_t shift = bit % 32, last = bit + field.bits - 1;
    add(bit / 32, shift == 0 ? name : "(" + name + " << " + number(shift) + ")");
    if (last / 32 != bit / 32) add(last / 32, "(" + name + " >> " + number(32 - shift) + ")");
    bit += field.bits;
  }
  std::string text = "// The vertex of these fields, each within its bits.\n" + prefix + "uvec4 vertex16_pack(" +
                     parameters + ") {\n  return uvec4(";
  for (size_t i = 0; i < words.size(); ++i) text += (i == 0 ? "" : ",\n               ") + words[i];
  return text + ");\n}\n";
}

/// Decoders of the fields, in the common subset of GLSL and C++ with GLM. $ stands for the prefix of functions.
constexpr std::string_view kDecoders = R"(
// Object space. Exact where |origin + field| <= 2^24; the same lattice point is the same float in every geometry.
$vec3 vertex16_position(uvec4 v, Vertex16Frame frame) {
  ivec3 field = ivec3(int(vertex16_position_x(v)), int(vertex16_position_y(v)), int(vertex16_position_z(v)));
  return vec3(frame.origin + field) * frame.step;
}

// Exact where |uv_origin + field| <= 2^24.
$vec2 vertex16_uv(uvec4 v, Vertex16Frame frame) {
  ivec2 field = ivec2(int(vertex16_uv_u(v)), int(vertex16_uv_v(v)));
  return vec2(frame.uv_origin + field) * frame.uv_step;
}

// Whether the triangle's own normal counts: cross(p1 - p0, p2 - p0) of its positions.
$bool vertex16_is_flat(uvec4 v) { return vertex16_normal(v) == @FLAT; }

$float vertex16_warp(int twice) {
  float t = float(twice) * @SCALE;
  return t * (@SLOPE + @CUBIC * (t * t));
}

// Unit length, object space; (0, 0, 0) where the vertex is flat.
$vec3 vertex16_decode_normal(uvec4 v) {
  uint code = vertex16_normal(v);
  if (code == @FLAT) return vec3(0.0f, 0.0f, 0.0f);
  uint column = code / @CODES;
  uint face = column / @CODES; // 2 axis + sign
  float a = vertex16_warp(2 * int(column - face * @CODES) - @LAST);
  float b = vertex16_warp(2 * int(code - column * @CODES) - @LAST);
  float c = sqrt(max(1.0f - (a * a + b * b), 0.0f));
  c = (face & 1u) != 0u ? -c : c;
  return face < 2u ? vec3(c, a, b) : face < 4u ? vec3(b, c, a) : vec3(a, b, c);
}

// Unit vectors that angle 0 and angle 1/4 point to: an orthonormal basis with the normal (unit length).
// Source: Duff et al., "Building an Orthonormal Basis, Revisited", 2017.
$vec3 vertex16_basis_x(vec3 n) {
  float s = n.z >= 0.0f ? 1.0f : -1.0f;
  float a = -1.0f / (s + n.z);
  return vec3(1.0f + s * n.x * n.x * a, s * (n.x * n.y * a), -s * n.x);
}
$vec3 vertex16_basis_y(vec3 n) {
  float s = n.z >= 0.0f ? 1.0f : -1.0f;
  float a = -1.0f / (s + n.z);
  return vec3(n.x * n.y * a, s + n.y * n.y * a, -n.y);
}

// The unit vector of a diamond angle, a place t in 0 .. 4 on the square |x| + |y| = 1.
$vec2 vertex16_diamond(float t) {
  float side = t < 2.0f ? 1.0f : -1.0f;
  float x = side * (1.0f - (t < 2.0f ? t : t - 2.0f));
  float y = side * (1.0f - abs(x));
  return vec2(x, y) * (1.0f / sqrt(x * x + y * y));
}

// Tangent, unit length and at right angles to the normal, and the sign of the bitangent sign * cross(normal, tangent).
// normal: that of vertex16_decode_normal(). Without meaning unless the draw says that it has tangents.
$vec4 vertex16_tangent(uvec4 v, vec3 normal) {
  vec2 d = vertex16_diamond(float(vertex16_tangent_angle(v)) * 0.015625f);
  vec3 tangent = vertex16_basis_x(normal) * d.x + vertex16_basis_y(normal) * d.y;
  return vec4(tangent, vertex16_tangent_sign(v) != 0u ? -1.0f : 1.0f);
}
)";

std::string replaced(std::string text, std::string_view from, std::string_view to) {
  for (size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
  return text;
}

std::string decoders(const std::string& prefix) {
  const NormalFormat& format = format_of(NormalEncoding::kAxis24);
  const uint32_t last = format.x_codes - 1;
  std::string text = replaced(std::string(kDecoders), "$", prefix);
  text = replaced(std::move(text), "@FLAT", number(kVertex16FlatNormal));
  text = replaced(std::move(text), "@SCALE", literal(1.0f / static_cast<float>(last)));
  text = replaced(std::move(text), "@SLOPE", literal(static_cast<float>(kAxisSlope)));
  text = replaced(std::move(text), "@CUBIC", literal(static_cast<float>(kAxisCubic)));
  text = replaced(std::move(text), "@CODES", number(format.x_codes));
  return replaced(std::move(text), "@LAST", std::to_string(last));
}

constexpr std::string_view kNotice = "// Made by vertex16_generator from vertex16_fields.h; "
                                     "docs/vertex16.md says where the bytes lie.\n";
constexpr std::string_view kFrame = R"(
// What a geometry's vertices share: 32 bytes, as std430 and C++ lay them out.
struct Vertex16Frame {
  ivec3 origin;    // lattice coordinates of position 0
  float step;      // object units
  ivec2 uv_origin; // of uv 0, in steps
  vec2 uv_step;    // powers of two
};

)";

} // namespace

std::string vertex16_glsl() {
  return std::string(kNotice) + "// GLSL 3.30 and later.\n" + std::string(kFrame) + field_readers("") + packer("") +
         decoders("");
}

std::string vertex16_cpp() {
  const std::string prefix = "inline ";
  return "#pragma once\n\n" + std::string(kNotice) +
         "// clang-format off\n\n#include <glm/glm.hpp>\n\nnamespace packtrace::vertex16 {\n\nusing glm::abs, "
         "glm::max, glm::sqrt;\n"
         "using glm::ivec2, glm::ivec3, glm::uint, glm::uvec4, glm::vec2, glm::vec3, glm::vec4;\n" +
         std::string(kFrame) + "static_assert(sizeof(Vertex16Frame) == 32);\n\n" + field_readers(prefix) +
         packer(prefix) + decoders(prefix) + "\n} // namespace packtrace::vertex16\n";
}

} // namespace packtrace
