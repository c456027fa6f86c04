#include "compress/format/cluster/uv_codec.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

float round_trip(UvEncoding encoding, float uv, int32_t exponent) {
  const std::optional<int32_t> code = encode_uv(encoding, uv, exponent);
  EXPECT_TRUE(code) << uv;
  return UvDecoder(encoding, exponent)(code.value_or(0));
}

TEST(UvCodec, ErrorIsAThirtySecondOfATexelAtMost) {
  test::Random random(6);
  for (const uint32_t texels : {1u, 3u, 1000u, 4096u, 16384u})
    for (const float scale : {1.0f, 0.37f, -8.0f}) {
      const int32_t exponent = choose_uv_exponent(texels, scale, 4.0f);
      for (int i = 0; i < 1000; ++i) {
        const float uv = random.uniform(-4, 4);
        const double error = std::abs(static_cast<double>(round_trip(UvEncoding::kLattice, uv, exponent)) - uv) *
                             texels * std::abs(scale);
        EXPECT_LE(error, 1.0 / 32.0 + 1e-12);
      }
    }
}

TEST(UvCodec, OneFarCoordinateDoesNotCoarsenTheOthers) {
  test::Random random(7);
  constexpr float kFar = 1e4f;
  const int32_t exponent = choose_uv_exponent(4096, 1.0f, kFar);
  for (int i = 0; i < 20000; ++i) {
    const float uv = i % 2 == 0 ? random.uniform(-1, 1) : random.uniform(-kFar, kFar);
    const double error = std::abs(static_cast<double>(round_trip(UvEncoding::kLattice, uv, exponent)) - uv) * 4096;
    EXPECT_LE(error, 1.0 / 32.0) << uv;
    if (std::abs(uv) > 256.0f) { // floats are coarser than the step here
      EXPECT_EQ(error, 0.0) << uv;
    }
  }
}

TEST(UvCodec, FarCoordinatesKeepTheFloatsOwnPrecision) {
  for (const float largest : {100000.0f, 3.0e38f, 65504.0f, std::nextafter(65536.0f, 0.0f)}) {
    const int32_t exponent = choose_uv_exponent(4096, 1.0f, largest);
    EXPECT_EQ(round_trip(UvEncoding::kLattice, largest, exponent), largest);
    EXPECT_EQ(round_trip(UvEncoding::kLattice, -largest, exponent), -largest);
  }
}

TEST(UvCodec, ExtremesStayInRange) {
  for (const float largest : {0.0f, std::numeric_limits<float>::denorm_min(), std::numeric_limits<float>::max()})
    for (const float scale : {0.0f, 1e-38f, 3e38f}) {
      const int32_t exponent = choose_uv_exponent(std::numeric_limits<uint32_t>::max(), scale, largest);
      EXPECT_GE(exponent, kMinUvExponent);
      EXPECT_LE(exponent, kMaxUvExponent);
      EXPECT_TRUE(encode_uv(UvEncoding::kLattice, largest, exponent));
      EXPECT_TRUE(encode_uv(UvEncoding::kLattice, -largest, exponent));
    }
  EXPECT_FALSE(encode_uv(UvEncoding::kLattice, 1.0f, -31));
}

TEST(UvCodec, Unorm16HoldsWhatSixteenBitsHoldInEveryTile) {
  const UvDecoder decode(UvEncoding::kUnorm16, 0);
  for (int32_t code = 0; code <= 65535; ++code) {
    const float uv = decode(code);
    EXPECT_EQ(uv, static_cast<float>(code / 65535.0));
    EXPECT_EQ(encode_uv(UvEncoding::kUnorm16, uv, 0), code);
  }
  EXPECT_EQ(round_trip(UvEncoding::kUnorm16, -3.0f, 0), -3.0f);
  EXPECT_EQ(round_trip(UvEncoding::kUnorm16, 1000.0f, 0), 1000.0f);
  EXPECT_FALSE(encode_uv(UvEncoding::kUnorm16, 16385.0f, 0));
}

TEST(UvCodec, Fp16CodesAreAllHalfFloatsInOrder) {
  const UvDecoder decode(UvEncoding::kFp16, 0);
  float last = -65536.0f;
  for (int32_t code = -kMaxFp16Code; code <= kMaxFp16Code; ++code) {
    const float uv = decode(code);
    EXPECT_GT(uv, last);
    EXPECT_EQ(encode_uv(UvEncoding::kFp16, uv, 0), code);
    last = uv;
  }
  // Bit patterns of IEEE 754 binary16.
  EXPECT_EQ(decode(0x3c00), 1.0f);
  EXPECT_EQ(decode(1), 0x1p-24f);
  EXPECT_EQ(decode(0x0400), 0x1p-14f);
  EXPECT_EQ(decode(0x3555), 0.333251953125f);
  EXPECT_EQ(decode(kMaxFp16Code), 65504.0f);
  EXPECT_EQ(decode(int64_t{1} << 40), 65504.0f);
}

TEST(UvCodec, Fp16RoundsToTheNearestAndRefusesWhatOverflows) {
  EXPECT_EQ(encode_uv(UvEncoding::kFp16, 1.0f + 0x1p-11f, 0), 0x3c00); // ties to even
  EXPECT_EQ(encode_uv(UvEncoding::kFp16, 1.0f + 0x1.8p-10f, 0), 0x3c02);
  EXPECT_EQ(encode_uv(UvEncoding::kFp16, std::nextafter(2.0f, 0.0f), 0), 0x4000); // carries into the exponent
  EXPECT_EQ(encode_uv(UvEncoding::kFp16, std::nextafter(0x1p-14f, 0.0f), 0), 0x0400);
  EXPECT_EQ(encode_uv(UvEncoding::kFp16, 0x1p-26f, 0), 0);
  EXPECT_EQ(encode_uv(UvEncoding::kFp16, 65519.0f, 0), kMaxFp16Code);
  EXPECT_FALSE(encode_uv(UvEncoding::kFp16, 65520.0f, 0));
  EXPECT_FALSE(encode_uv(UvEncoding::kFp16, 1e30f, 0));
}

TEST(UvCodec, Fp16IsSafeForTexturesOf4096UpToAQuarterOnly) {
  const auto worst_texels = [](float lo, float hi) {
    double worst = 0.0;
    for (float uv = lo; uv < hi; uv += 0x1p-18f)
      worst = std::max(worst, 4096.0 * std::abs(round_trip(UvEncoding::kFp16, uv, 0) - double{uv}));
    return worst;
  };
  EXPECT_EQ(worst_texels(0.0f, 0.25f), 0.25);
  EXPECT_EQ(worst_texels(0.25f, 0.5f), 0.5);
  EXPECT_EQ(worst_texels(0.5f, 1.0f), 1.0);
}

} // namespace
} // namespace packtrace
