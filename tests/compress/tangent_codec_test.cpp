#include "compress/format/cluster/tangent_codec.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/compress/q_tangent.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

double angle(DVec3 a, DVec3 b) { return 2.0 * std::asin(std::min(0.5 * glm::length(a - b), 1.0)); }

DVec3 direction(test::Random& random) {
  for (;;) {
    const DVec3 v(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    if (const double length = glm::length(v); length > 0.1 && length <= 1.0) return v / length;
  }
}

TEST(UvTangent, IsTheDirectionInWhichUGrows) {
  // u = x / 2 + 3, v = 5 y on a rotated plane: P = x a + y b.
  const DVec3 a = glm::normalize(DVec3(1, 2, 3)), b = glm::normalize(glm::cross(a, DVec3(0, 1, 0)));
  const std::array<glm::dvec2, 3> places{{{0, 0}, {2, 1}, {-1, 3}}};
  std::array<DVec3, 3> positions;
  std::array<glm::dvec2, 3> uvs;
  for (size_t i = 0; i < 3; ++i) {
    positions[i] = a * places[i].x + b * places[i].y;
    uvs[i] = {places[i].x / 2 + 3, 5 * places[i].y};
  }
  const UvTangent tangent = uv_tangent(positions, uvs);
  EXPECT_NEAR(glm::distance(tangent.tangent, a), 0.0, 1e-14);
  EXPECT_FALSE(tangent.mirrored);
  EXPECT_NEAR(tangent.area, 7.0, 1e-12);
  for (glm::dvec2& uv : uvs) uv.x = -uv.x;
  EXPECT_NEAR(glm::distance(uv_tangent(positions, uvs).tangent, -a), 0.0, 1e-14);
  EXPECT_TRUE(uv_tangent(positions, uvs).mirrored);
  uvs.fill({1, 2});
  EXPECT_EQ(uv_tangent(positions, uvs).tangent, DVec3(0.0));
}

TEST(Diamond, CodesComeBackAndErrorsStayBelowTheBound) {
  test::Random random(3);
  for (const uint32_t bits : {2u, 6u, 8u, 12u, 16u}) {
    for (uint32_t code = 0; code < 1u << std::min(bits, 12u); ++code)
      ASSERT_EQ(encode_diamond(decode_diamond(code, bits), bits), code);
    for (int i = 0; i < 20000; ++i) {
      const double phi = static_cast<double>(random.uniform(-4, 4));
      const glm::dvec2 d(std::cos(phi), std::sin(phi)), back = decode_diamond(encode_diamond(d * 7.0, bits), bits);
      // A side of length sqrt(2) has 2^bits / 4 codes; its middle is sqrt(1/2) from the origin.
      ASSERT_LE(std::acos(std::min(glm::dot(d, back), 1.0)), std::ldexp(4.0, -static_cast<int>(bits)) + 1e-7);
    }
  }
  EXPECT_EQ(encode_diamond({1, 0}, 8), 0u);
  EXPECT_EQ(encode_diamond({0, 1}, 8), 64u);
  EXPECT_EQ(encode_diamond({-1, 0}, 8), 128u);
  EXPECT_EQ(encode_diamond({0, -1}, 8), 192u);
  EXPECT_EQ(encode_diamond({1, -1e-9}, 8), 0u); // wraps around
}

TEST(QTangent, FramesComeBackWithTheirSign) {
  test::Random random(4);
  for (const uint32_t bits : {8u, 10u, 16u, 24u}) {
    double worst = 0.0;
    for (int i = 0; i < 20000; ++i) {
      test::TangentFrame frame;
      frame.normal = direction(random);
      frame.tangent = glm::normalize(glm::cross(frame.normal, direction(random)));
      frame.mirrored = random.bits() % 2 != 0;
      // w is 0 for these frames.
      if (i % 4 == 0) frame.normal = {0, 0, -1}, frame.tangent = {std::cos(i), std::sin(i), 0};
      const test::TangentFrame back = test::decode_q_tangent(test::encode_q_tangent(frame, bits), bits);
      ASSERT_EQ(back.mirrored, frame.mirrored);
      worst = std::max({worst, angle(back.normal, frame.normal), angle(back.tangent, frame.tangent)});
      ASSERT_NEAR(glm::dot(back.normal, back.tangent), 0.0, 1e-12);
    }
    EXPECT_LE(worst, std::ldexp(4.0, 1 - static_cast<int>(bits))); // errors of a quaternion count twice in the rotation
    EXPECT_GE(worst, std::ldexp(0.5, 1 - static_cast<int>(bits)));
  }
  const test::TangentFrame none = test::decode_q_tangent({0, 0, 0, 0}, 8);
  EXPECT_EQ(none.normal, DVec3(0, 0, 1));
}

} // namespace
} // namespace packtrace
