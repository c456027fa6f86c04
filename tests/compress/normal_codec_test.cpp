#include "compress/format/normal_codec.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

double angle_degrees(DVec3 a, DVec3 b) {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)) * 57.295779513082320877;
}

TEST(Zsign32, LayoutIsSignThenXThenY) {
  EXPECT_EQ(encode_zsign32({0, 0, 1}), (16383u << 16) | 32767u);
  EXPECT_EQ(encode_zsign32({0, 0, -1}), 0x80000000u | (16383u << 16) | 32767u);
  EXPECT_EQ(encode_zsign32({1, 0, 0}) & 0x7fffffffu, (32766u << 16) | 32767u);
  EXPECT_EQ(encode_zsign32({0, -1, 0}) & 0x7fffffffu, 16383u << 16);
  EXPECT_EQ(decode_zsign32((16383u << 16) | 32767u), Vec3(0, 0, 1));
}

TEST(Zsign32, EveryCodeDecodesToUnitLength) {
  test::Random random(2);
  for (int i = 0; i < 200000; ++i) {
    const Vec3 n = decode_zsign32(random.bits());
    ASSERT_NEAR(glm::length(n), 1.0f, 3e-7f);
  }
  for (const uint32_t code : {0u, ~0u, 0x7fffffffu, 0x80000000u, 0x7fff0000u, 0x0000ffffu})
    EXPECT_NEAR(glm::length(decode_zsign32(code)), 1.0f, 3e-7f);
}

TEST(Zsign32, ErrorIsBoundedAndTypicallyTiny) {
  test::Random random(3);
  double sum = 0.0;
  constexpr int kCount = 100000;
  for (int i = 0; i < kCount; ++i) {
    const DVec3 n = glm::normalize(DVec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)));
    const double error = angle_degrees(n, DVec3(decode_zsign32(encode_zsign32(n))));
    ASSERT_LE(error, kZsign32MaxErrorDegrees);
    sum += error;
  }
  EXPECT_LT(sum / kCount, 0.005);
}

TEST(Zsign32, ErrorIsBoundedAtTheEquator) {
  test::Random random(4);
  double worst = 0.0;
  for (int i = 0; i < 100000; ++i) {
    const double phi = random.uniform(0.0f, 6.2831853f), z = random.uniform(-0.01f, 0.01f);
    const DVec3 n = glm::normalize(DVec3(std::cos(phi), std::sin(phi), z));
    worst = std::max(worst, angle_degrees(n, DVec3(decode_zsign32(encode_zsign32(n)))));
  }
  EXPECT_LE(worst, kZsign32MaxErrorDegrees);
  EXPECT_GT(worst, 0.1); // the format's known weak place: if it is gone, this is another format
}

TEST(Zsign32, InputsOfAnyLengthAreNormalised) {
  const DVec3 n = glm::normalize(DVec3(0.3, -0.9, 0.2));
  for (const double length : {1e-300, 1e-40, 0.999, 1.0000001, 1e30, 1e300})
    EXPECT_EQ(encode_zsign32(n * length), encode_zsign32(n));
  EXPECT_EQ(encode_zsign32({1.0000001, 0, 1e-9}) >> 31, 0u); // does not overflow into the sign
}

TEST(Zsign32, ReencodingADecodedNormalChangesItByNoMoreThanTheBound) {
  test::Random random(5);
  for (int i = 0; i < 20000; ++i) {
    const DVec3 n(decode_zsign32(random.bits()));
    EXPECT_LE(angle_degrees(n, DVec3(decode_zsign32(encode_zsign32(n)))), kZsign32MaxErrorDegrees);
  }
}

} // namespace
} // namespace packtrace
