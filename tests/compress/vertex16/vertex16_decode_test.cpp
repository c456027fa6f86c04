#include "compress/exchange/vertex16/vertex16_decode.h"

#include <cmath>
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

#include "compress/exchange/vertex16/vertex16_fields.h"
#include "compress/exchange/vertex16/vertex16_generator.h"
#include "compress/format/cluster/normal_codec.h"
#include "tests/compress/test_scenes.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

using namespace vertex16;

std::string read_text(const std::string& file) {
  std::ifstream in(PACKTRACE_SOURCE_DIR "/" + file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

uvec4 with_normal(uint32_t code) { return vertex16_pack(0, 0, 0, 0, code, 0, 0, 0); }

TEST(Vertex16Generator, WhatItWroteIsCurrent) {
  EXPECT_EQ(read_text("compress/exchange/vertex16/vertex16.glsl"), vertex16_glsl())
      << "run vertex16_generator compress/exchange/vertex16";
  EXPECT_EQ(read_text("compress/exchange/vertex16/vertex16_decode.h"), vertex16_cpp())
      << "run vertex16_generator compress/exchange/vertex16";
}

TEST(Vertex16Generator, TheManualHasTheSameFields) {
  const std::string manual = read_text("docs/vertex16.md");
  uint32_t bit = 0;
  for (const Vertex16Field& field : kVertex16Fields) {
    const std::string row = "| " + std::to_string(bit) + " | " + std::to_string(field.bits) + " | `" +
                            std::string(field.name) + "` | " + std::string(field.meaning) + " |";
    EXPECT_NE(manual.find(row), std::string::npos) << row;
    bit += field.bits;
  }
}

TEST(Vertex16, FieldsComeBackAndLeaveTheOthersAlone) {
  test::Random random(3);
  for (int i = 0; i < 20000; ++i) {
    std::array<uint32_t, 8> in{};
    for (size_t f = 0; f < in.size(); ++f) {
      const uint32_t all = static_cast<uint32_t>((uint64_t{1} << kVertex16Fields[f].bits) - 1);
      const uint32_t kind = random.bits() % 3;
      in[f] = kind == 0 ? 0 : kind == 1 ? all : random.bits() & all;
    }
    const uvec4 v = vertex16_pack(in[0], in[1], in[2], in[3], in[4], in[5], in[6], in[7]);
    const std::array<uint32_t, 8> out{vertex16_position_x(v),   vertex16_position_y(v), vertex16_position_z(v),
                                      vertex16_tangent_sign(v), vertex16_normal(v),     vertex16_tangent_angle(v),
                                      vertex16_uv_u(v),         vertex16_uv_v(v)};
    ASSERT_EQ(in, out);
  }
}

TEST(Vertex16, BytesLieWhereTheManualSays) {
  const uvec4 v = vertex16_pack(0x12345, 0x1abcde, 0x0f0f0f, 1, 0xabcdef, 0x42, 0x1234, 0x5678);
  EXPECT_EQ(v, uvec4(0x12345u | (0x1abcdeu << 21), (0x1abcdeu >> 11) | (0x0f0f0fu << 10) | 0x80000000u, 0x42abcdefu,
                     0x56781234u));
  // Read the vertex as one 128-bit number, lowest bits first, with the offsets of the table.
  const auto bits = [&](uint32_t at, uint32_t count) {
    uint64_t value = 0;
    for (uint32_t i = 0; i < count; ++i) value |= uint64_t{(v[(at + i) / 32] >> ((at + i) % 32)) & 1u} << i;
    return value;
  };
  EXPECT_EQ(bits(0, 21), 0x12345u);
  EXPECT_EQ(bits(21, 21), 0x1abcdeu);
  EXPECT_EQ(bits(42, 21), 0x0f0f0fu);
  EXPECT_EQ(bits(63, 1), 1u);
  EXPECT_EQ(bits(64, 24), 0xabcdefu);
  EXPECT_EQ(bits(88, 8), 0x42u);
  EXPECT_EQ(bits(96, 16), 0x1234u);
  EXPECT_EQ(bits(112, 16), 0x5678u);
}

TEST(Vertex16, EveryNormalCodeDecodesAsInTheBakedFile) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  constexpr uint32_t kCodes = 6 * 1671 * 1671;
  uint32_t different = 0;
  for (uint32_t code = 0; code < kCodes; ++code)
    different += vertex16_decode_normal(with_normal(code)) != decode_normal(NormalEncoding::kAxis24, code);
  EXPECT_EQ(different, 0u);
  EXPECT_TRUE(vertex16_is_flat(with_normal(kVertex16FlatNormal)));
  EXPECT_FALSE(vertex16_is_flat(with_normal(kCodes - 1)));
  EXPECT_EQ(vertex16_decode_normal(with_normal(kVertex16FlatNormal)), Vec3(0.0f));
}

TEST(Vertex16, TangentsAreUnitVectorsAtRightAnglesAndEvenlySpread) {
  test::Random random(5);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 direction(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    const Vec3 n = vertex16_decode_normal(with_normal(encode_normal(NormalEncoding::kAxis24, DVec3(direction))));
    for (uint32_t angle = 0; angle < 256; ++angle) {
      const vec4 t = vertex16_tangent(vertex16_pack(0, 0, 0, angle & 1u, 0, angle, 0, 0), n);
      ASSERT_NEAR(glm::length(Vec3(t)), 1.0f, 2e-6f);
      ASSERT_NEAR(glm::dot(Vec3(t), n), 0.0f, 2e-6f);
      ASSERT_EQ(t.w, (angle & 1u) != 0 ? -1.0f : 1.0f);
      const vec4 next = vertex16_tangent(vertex16_pack(0, 0, 0, 0, 0, (angle + 1) & 255u, 0, 0), n);
      // 1/64 of a side turns the direction by 1/64 to 1/32 radians.
      const float turn = std::acos(std::min(glm::dot(Vec3(t), Vec3(next)), 1.0f));
      ASSERT_GT(turn, 0.0150f);
      ASSERT_LT(turn, 0.0316f);
    }
  }
}

TEST(Vertex16, PositionsAndTextureCoordinatesAreExact) {
  Vertex16Frame frame;
  frame.origin = {-(1 << 23), 5, 1 << 23};
  frame.step = 13.0f * 0x1p-12f;
  frame.uv_origin = {-70000, 3};
  frame.uv_step = {0x1p-10f, 0x1p-16f};
  const uvec4 v = vertex16_pack(7, (1u << 21) - 1, 1, 0, 0, 0, 65535, 1);
  EXPECT_EQ(vertex16_position(v, frame),
            Vec3(float((7 - (1 << 23)) * 13.0 * 0x1p-12), float((5 + (1 << 21) - 1) * 13.0 * 0x1p-12),
                 float(((1 << 23) + 1) * 13.0 * 0x1p-12)));
  EXPECT_EQ(vertex16_uv(v, frame), Vec2(-4465.0f * 0x1p-10f, 4.0f * 0x1p-16f));
}

} // namespace
} // namespace packtrace
