#include "compress/format/uv_codec.h"

#include <limits>

#include <gtest/gtest.h>

#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

float round_trip(float uv, int32_t exponent) {
  return from_uv_lattice(to_uv_lattice(uv, exponent), std::ldexp(1.0f, exponent));
}

TEST(UvCodec, ErrorIsAThirtySecondOfATexelAtMost) {
  test::Random random(6);
  for (const uint32_t texels : {1u, 3u, 1000u, 4096u, 16384u})
    for (const float scale : {1.0f, 0.37f, -8.0f}) {
      const int32_t exponent = choose_uv_exponent(texels, scale, 4.0f);
      for (int i = 0; i < 1000; ++i) {
        const float uv = random.uniform(-4, 4);
        const double error = std::abs(static_cast<double>(round_trip(uv, exponent)) - uv) * texels * std::abs(scale);
        EXPECT_LE(error, 1.0 / 32.0 + 1e-12);
      }
    }
}

TEST(UvCodec, FarCoordinatesKeepTheFloatsOwnPrecision) {
  for (const float largest : {100000.0f, 3.0e38f, 65504.0f}) {
    const int32_t exponent = choose_uv_exponent(4096, 1.0f, largest);
    EXPECT_LE(std::abs(to_uv_lattice(largest, exponent)), kMaxUvLattice);
    EXPECT_EQ(round_trip(largest, exponent), largest);
    EXPECT_EQ(round_trip(-largest, exponent), -largest);
  }
}

TEST(UvCodec, ExtremesStayInRange) {
  for (const float largest : {0.0f, std::numeric_limits<float>::denorm_min(), std::numeric_limits<float>::max()})
    for (const float scale : {0.0f, 1e-38f, 3e38f}) {
      const int32_t exponent = choose_uv_exponent(std::numeric_limits<uint32_t>::max(), scale, largest);
      EXPECT_GE(exponent, kMinUvExponent);
      EXPECT_LE(exponent, kMaxUvExponent);
      EXPECT_LE(std::abs(to_uv_lattice(largest, exponent)), kMaxUvLattice);
    }
}

} // namespace
} // namespace packtrace
