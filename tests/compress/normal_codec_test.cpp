#include "compress/format/cluster/normal_codec.h"

#include <array>
#include <bit>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "compress/format/cluster/normal_packing.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

double angle_degrees(DVec3 a, DVec3 b) {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)) * 57.295779513082320877;
}

DVec3 random_direction(test::Random& random) {
  const double z = random.uniform(-1, 1), phi = random.uniform(0.0f, 6.2831853f), r = std::sqrt(1.0 - z * z);
  return {r * std::cos(phi), r * std::sin(phi), z};
}

class NormalCodec : public testing::TestWithParam<NormalEncoding> {
protected:
  NormalEncoding encoding() const { return GetParam(); }
  const NormalFormat& format() const { return format_of(GetParam()); }
  uint64_t code_count() const { return uint64_t{format().charts} * format().x_codes * format().y_codes; }
  uint32_t random_code(test::Random& random) const {
    return static_cast<uint32_t>(((uint64_t{random.bits()} << 32) | random.bits()) % code_count());
  }
  double error(DVec3 n) const {
    return angle_degrees(glm::normalize(n), DVec3(decode_normal(encoding(), encode_normal(encoding(), n))));
  }
};

TEST_P(NormalCodec, CodesFitTheirBitsAndNoMoreOfThemWould) {
  EXPECT_LE(code_count(), uint64_t{1} << format().bits);
  if (format().family == NormalFamily::kAxis) { // odd, so that 0 is a code
    const uint64_t next = format().x_codes + 2;
    EXPECT_EQ(format().x_codes % 2, 1u);
    EXPECT_GT(format().charts * next * next, uint64_t{1} << format().bits);
  }
}

TEST_P(NormalCodec, CodesSplitAndJoin) {
  test::Random random(20);
  for (int i = 0; i < 20000; ++i) {
    const uint32_t code = random_code(random);
    const NormalFields fields = split_normal_code(encoding(), code);
    ASSERT_LT(fields.chart, format().charts);
    ASSERT_TRUE(fields.x >= 0 && fields.x < static_cast<int32_t>(format().x_codes));
    ASSERT_TRUE(fields.y >= 0 && fields.y < static_cast<int32_t>(format().y_codes));
    ASSERT_EQ(join_normal_code(encoding(), fields), code);
  }
}

// Although only the corners of each chart's range are tried.
TEST_P(NormalCodec, TheNarrowestPackingIsThatOfAllNormals) {
  test::Random random(21);
  for (int round = 0; round < 3000; ++round) {
    // Normals around one direction, in any part of the sphere that up to three charts share.
    const DVec3 centre = random_direction(random);
    const double spread = std::exp2(-static_cast<double>(random.bits() % 12u));
    std::vector<NormalFields> fields(1 + random.bits() % 40u);
    for (NormalFields& one : fields)
      one = split_normal_code(encoding(), encode_normal(encoding(), centre + spread * random_direction(random)));
    std::optional<NormalPacking> best;
    for (uint32_t chart = 0; chart <= format().charts; ++chart)
      if (const auto packing = pack_normals(encoding(), fields, chart); packing)
        if (!best || packing->stride() < best->stride()) best = packing;
    ASSERT_TRUE(best);
    ASSERT_EQ(choose_normal_packing(encoding(), fields), *best) << round;
  }
}

TEST_P(NormalCodec, EveryNumberDecodesToUnitLength) { // also numbers that are no codes
  test::Random random(2);
  for (int i = 0; i < 200000; ++i) {
    const uint32_t code = i % 2 == 0 ? random.bits() : random_code(random);
    ASSERT_NEAR(glm::length(decode_normal(encoding(), code)), 1.0f, 3e-7f) << code;
  }
  const auto last = static_cast<uint32_t>(code_count() - 1);
  for (const uint32_t code : {0u, ~0u, 0x7fffffffu, 0x80000000u, 0x7fff0000u, 0x0000ffffu, last, last + 1})
    EXPECT_NEAR(glm::length(decode_normal(encoding(), code)), 1.0f, 3e-7f) << code;
}

TEST_P(NormalCodec, TheErrorStaysBelowItsBoundAndComesNearIt) {
  test::Random random(3);
  double worst = 0.0;
  for (int i = 0; i < 60000; ++i) {
    DVec3 n = random_direction(random);
    if (i % 3 == 1) n.z *= 0.01;                                // near the equator, where zsign is least accurate
    if (i % 3 == 2) n.y = std::copysign(n.x, n.y) * (1 + 1e-5); // at borders of charts
    worst = std::max(worst, error(n));
  }
  EXPECT_LE(worst, format().max_error_degrees);
  EXPECT_GT(worst, 0.85 * format().max_error_degrees); // the bound must be tight
}

TEST_P(NormalCodec, AxesAndDiagonalsStayBelowTheBound) {
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z) {
        if (x == 0 && y == 0 && z == 0) continue;
        EXPECT_LE(error(DVec3(x, y, z)), format().max_error_degrees);
        EXPECT_LE(error(DVec3(x, y, z) + DVec3(-0.0, 1e-12, -1e-9)), format().max_error_degrees);
        if (std::abs(x) + std::abs(y) + std::abs(z) == 1 && format().family != NormalFamily::kZsign) {
          EXPECT_EQ(decode_normal(encoding(), encode_normal(encoding(), DVec3(x, y, z))), Vec3(x, y, z));
        }
      }
}

TEST_P(NormalCodec, InputsOfAnyLengthAreNormalised) {
  const DVec3 n = glm::normalize(DVec3(0.3, -0.9, 0.2));
  for (const double length : {1e-300, 1e-40, 0.999, 1.0000001, 1e30, 1e300})
    EXPECT_EQ(encode_normal(encoding(), n * length), encode_normal(encoding(), n));
}

TEST_P(NormalCodec, ReencodingADecodedNormalChangesItByNoMoreThanTheBound) {
  test::Random random(5);
  for (int i = 0; i < 20000; ++i)
    ASSERT_LE(error(DVec3(decode_normal(encoding(), random_code(random)))), format().max_error_degrees);
}

TEST_P(NormalCodec, UnfoldingComesBackAndChangesNothing) {
  test::Random random(6);
  uint32_t unfolded = 0;
  for (int i = 0; i < 20000; ++i) {
    NormalFields fields = split_normal_code(encoding(), random_code(random));
    if (i % 4 == 0) fields.x = i % 8 == 0 ? 0 : static_cast<int32_t>(format().x_codes) - 1; // borders of charts
    if (i % 5 == 0) fields.y = i % 10 == 0 ? 0 : static_cast<int32_t>(format().y_codes) - 1;
    for (uint32_t chart = 0; chart < format().charts; ++chart) {
      const auto placed = unfold_normal(encoding(), fields, chart);
      if (chart == fields.chart) {
        EXPECT_EQ(placed, fields);
      }
      if (!placed) continue;
      unfolded += chart != fields.chart;
      ASSERT_EQ(placed->chart, chart);
      ASSERT_EQ(fold_normal(encoding(), *placed), fields);
    }
  }
  EXPECT_EQ(unfolded, format().family == NormalFamily::kAxis ? 80000u : 0u); // all but the opposite face
}

TEST_P(NormalCodec, FoldingIsTotal) {
  test::Random random(7);
  constexpr int32_t kFar = 1 << 20;
  for (int i = 0; i < 100000; ++i) {
    const auto any = [&] { return static_cast<int32_t>(random.bits() % (2 * kFar)) - kFar; };
    const int32_t x = any(), y = any();
    const NormalFields fields = fold_normal(encoding(), {random.bits() % 20, x, y});
    ASSERT_LT(fields.chart, format().charts);
    ASSERT_TRUE(fields.x >= 0 && fields.x < static_cast<int32_t>(format().x_codes));
    ASSERT_TRUE(fields.y >= 0 && fields.y < static_cast<int32_t>(format().y_codes));
  }
}

TEST_P(NormalCodec, IsFoundByItsName) { EXPECT_EQ(find_normal_encoding(format().name), encoding()); }

INSTANTIATE_TEST_SUITE_P(Encodings, NormalCodec,
                         testing::Values(NormalEncoding::kZsign32, NormalEncoding::kAxis32, NormalEncoding::kAxis24,
                                         NormalEncoding::kAxis16, NormalEncoding::kOct32, NormalEncoding::kOct24,
                                         NormalEncoding::kOct20, NormalEncoding::kOct16, NormalEncoding::kAxis12),
                         [](const auto& test) { return std::string(format_of(test.param).name); });

TEST(Zsign32, LayoutIsSignThenXThenY) {
  constexpr auto kEncoding = NormalEncoding::kZsign32;
  EXPECT_EQ(encode_normal(kEncoding, {0, 0, 1}), (16383u << 16) | 32767u);
  EXPECT_EQ(encode_normal(kEncoding, {0, 0, -1}), 0x80000000u | (16383u << 16) | 32767u);
  EXPECT_EQ(encode_normal(kEncoding, {1, 0, 0}) & 0x7fffffffu, (32766u << 16) | 32767u);
  EXPECT_EQ(encode_normal(kEncoding, {0, -1, 0}) & 0x7fffffffu, 16383u << 16);
  EXPECT_EQ(decode_normal(kEncoding, (16383u << 16) | 32767u), Vec3(0, 0, 1));
  EXPECT_EQ(encode_normal(kEncoding, {1.0000001, 0, 1e-9}) >> 31, 0u); // must not overflow into the sign
}

TEST(Zsign32, ErrsAtTheEquatorWhereTheAxisEncodingsDoNot) {
  test::Random random(4);
  double zsign = 0.0, axis = 0.0;
  for (int i = 0; i < 50000; ++i) {
    const double phi = random.uniform(0.0f, 6.2831853f), z = random.uniform(-0.01f, 0.01f);
    const DVec3 n = glm::normalize(DVec3(std::cos(phi), std::sin(phi), z));
    const auto error = [&](NormalEncoding e) { return angle_degrees(n, DVec3(decode_normal(e, encode_normal(e, n)))); };
    zsign = std::max(zsign, error(NormalEncoding::kZsign32));
    axis = std::max(axis, error(NormalEncoding::kAxis32));
  }
  EXPECT_GT(zsign, 0.1); // known weakness of the published format, which must not change
  EXPECT_LT(axis, 0.0025);
}

TEST(AxisNormals, LayoutIsChartThenXThenY) {
  constexpr auto kEncoding = NormalEncoding::kAxis16; // 103 codes each, 51 stands for 0
  EXPECT_EQ(encode_normal(kEncoding, {1, 0, 0}), (0u * 103 + 51) * 103 + 51);
  EXPECT_EQ(encode_normal(kEncoding, {-1, 0, 0}), (1u * 103 + 51) * 103 + 51);
  EXPECT_EQ(encode_normal(kEncoding, {0, 0, -1}), (5u * 103 + 51) * 103 + 51);
  // Component a + 1 holds x: for axis y it is z. The border is where both are equally large.
  EXPECT_EQ(encode_normal(kEncoding, {0, 1, 0.999999}), (2u * 103 + 102) * 103 + 51);
  EXPECT_EQ(encode_normal(kEncoding, {-0.999999, 1, 0}), (2u * 103 + 51) * 103 + 0);
}

TEST(AxisNormals, NeighboursOnTheCrossAreNeighboursOnTheSphere) {
  constexpr auto kEncoding = NormalEncoding::kAxis24;
  constexpr int32_t kLast = 1670;
  const double step = 0.1; // degrees; adjacent codes are at most 0.054 apart
  for (uint32_t chart = 0; chart < 6; ++chart)
    for (int32_t x = -kLast - 1; x < 2 * kLast + 1; ++x) { // along the middle, across both borders
      const auto at = [&](int32_t u) {
        return DVec3(decode_normal(kEncoding, fold_normal(kEncoding, {chart, u, 835})));
      };
      ASSERT_LT(angle_degrees(at(x), at(x + 1)), step) << chart << " " << x;
    }
}

TEST(OctNormals, LayoutIsXThenY) {
  constexpr auto kEncoding = NormalEncoding::kOct16; // 0 .. 254, 127 stands for 0
  EXPECT_EQ(encode_normal(kEncoding, {0, 0, 1}), (127u << 8) | 127u);
  EXPECT_EQ(encode_normal(kEncoding, {1, 0, 0}), (254u << 8) | 127u);
  EXPECT_EQ(encode_normal(kEncoding, {0, -1, 0}), (127u << 8) | 0u);
  EXPECT_EQ(encode_normal(kEncoding, {0, 0, -1}) & 0x00ffu, 254u); // a corner of the square
}

TEST(NormalFormats, CodesAndDecodedBitsStayAsTheyAre) {
  struct Golden {
    NormalEncoding encoding;
    DVec3 normal;
    uint32_t code;
    std::array<uint32_t, 3> bits; ///< of the decoded floats
  };
  const DVec3 a(0.3, -0.9, 0.2), b(-0.5, 0.6, -0.7);
  const std::array<Golden, 18> golden{{
      {NormalEncoding::kZsign32, a, 0x53cc092e, {0x3e9e6a78, 0xbf6da3db, 0x3e534167}},
      {NormalEncoding::kZsign32, b, 0xa17dc938, {0xbef413d0, 0x3f127324, 0xbf2add92}},
      {NormalEncoding::kAxis32, a, 0x9af621cd, {0x3e9e6f4e, 0xbf6da36a, 0x3e533ad7}},
      {NormalEncoding::kAxis32, b, 0xdd227477, {0xbef41668, 0x3f127428, 0xbf2adbc6}},
      {NormalEncoding::kAxis24, a, 0x009ac305, {0x3e9e8856, 0xbf6da18d, 0x3e53113b}},
      {NormalEncoding::kAxis24, b, 0x00dcdb1d, {0xbef45451, 0x3f125f49, 0xbf2ad789}},
      {NormalEncoding::kAxis16, a, 0x000096c1, {0x3e9b1235, 0xbf6dc3d5, 0x3e5acc7e}},
      {NormalEncoding::kAxis16, b, 0x0000d735, {0xbef22c77, 0x3f13ee7a, 0xbf2a43e3}},
      {NormalEncoding::kOct32, a, 0x9b6c2db6, {0x3e9e69b2, 0xbf6da451, 0x3e533b71}},
      {NormalEncoding::kOct32, b, 0x2aaadc70, {0xbef4166f, 0x3f12727e, 0xbf2add31}},
      {NormalEncoding::kOct24, a, 0x009b62db, {0x3e9e8b9e, 0xbf6da334, 0x3e52e98a}},
      {NormalEncoding::kOct24, b, 0x002aadc5, {0xbef44312, 0x3f1262af, 0xbf2adac9}},
      {NormalEncoding::kOct20, a, 0x0009b0b6, {0x3e9d909b, 0xbf6dcaf8, 0x3e530cd9}},
      {NormalEncoding::kOct20, b, 0x0002ab70, {0xbef42a12, 0x3f12279a, 0xbf2b1644}},
      {NormalEncoding::kOct16, a, 0x00009a2d, {0x3e9cc1dc, 0xbf6e09ef, 0x3e51027a}},
      {NormalEncoding::kOct16, b, 0x00002adb, {0xbef1e00d, 0x3f112009, 0xbf2cc49c}},
      {NormalEncoding::kAxis12, a, 0x000008db, {0x3ea46fe7, 0xbf6d4054, 0x3e47844f}},
      {NormalEncoding::kAxis12, b, 0x00000cae, {0xbefff974, 0x3f0e3d17, 0xbf2a11a6}},
  }};
  for (const Golden& g : golden) {
    EXPECT_EQ(encode_normal(g.encoding, g.normal), g.code) << format_of(g.encoding).name;
    const Vec3 n = decode_normal(g.encoding, g.code);
    const std::array<uint32_t, 3> bits{std::bit_cast<uint32_t>(n.x), std::bit_cast<uint32_t>(n.y),
                                       std::bit_cast<uint32_t>(n.z)};
    EXPECT_EQ(bits, g.bits) << format_of(g.encoding).name;
  }
}

TEST(NormalFormats, TheNearestNormalComesWithItsCode) {
  for (size_t e = 0; e < kNormalFormats.size(); ++e)
    for (int i = 0; i < 2000; ++i) {
      const auto encoding = static_cast<NormalEncoding>(e);
      const double z = (i + 0.5) / 1000.0 - 1.0, angle = 2.399963 * i; // evenly on the sphere
      const DVec3 n(std::sqrt(1.0 - z * z) * std::cos(angle), std::sqrt(1.0 - z * z) * std::sin(angle), z);
      const NearestNormal near = find_nearest_normal(encoding, n);
      EXPECT_EQ(near.code, encode_normal(encoding, n));
      EXPECT_EQ(near.decoded, decode_normal(encoding, near.code));
    }
}

TEST(NormalFormats, NamesOfOthersAreNotFound) {
  for (const char* name : {"", "auto", "axis", "zsign", "oct8", "AXIS24"}) EXPECT_FALSE(find_normal_encoding(name));
}

} // namespace
} // namespace packtrace
