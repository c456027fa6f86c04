#include "compress/bake/bake_config.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

bool accepted(PrecisionKind kind, double value) {
  BakeConfig config;
  config.precision_kind = kind;
  config.precision = value;
  try {
    config.validate();
    return true;
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kUsage);
    return false;
  }
}

TEST(BakeConfig, DefaultIsValid) { EXPECT_NO_THROW(BakeConfig{}.validate()); }

TEST(BakeConfig, ValuesOutOfRangeAreRefusedNotClamped) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const PrecisionKind kind : {PrecisionKind::kEdgeFraction, PrecisionKind::kDiagonalFraction,
                                   PrecisionKind::kAbsolute, PrecisionKind::kPositionBits})
    for (const double bad : {0.0, -1.0, std::nan(""), kInfinity, -kInfinity, 1e300, 1e-46})
      EXPECT_FALSE(accepted(kind, bad)) << static_cast<int>(kind) << " " << bad;
  EXPECT_TRUE(accepted(PrecisionKind::kEdgeFraction, 1.0));
  EXPECT_FALSE(accepted(PrecisionKind::kEdgeFraction, 1.0001));
  EXPECT_TRUE(accepted(PrecisionKind::kEdgeFraction, 1e-9));
  EXPECT_TRUE(accepted(PrecisionKind::kDiagonalFraction, 0.1));
  EXPECT_TRUE(accepted(PrecisionKind::kDiagonalFraction, 1e-12));
  EXPECT_FALSE(accepted(PrecisionKind::kDiagonalFraction, 0.11));
  EXPECT_TRUE(accepted(PrecisionKind::kAbsolute, 1e30));
  EXPECT_TRUE(accepted(PrecisionKind::kPositionBits, 14));
  EXPECT_FALSE(accepted(PrecisionKind::kPositionBits, 14.5));
  EXPECT_FALSE(accepted(PrecisionKind::kPositionBits, 41));
  EXPECT_FALSE(accepted(static_cast<PrecisionKind>(9), 1.0));
}

TEST(BakeConfig, NormalErrorsOutOfRangeAreRefusedNotClamped) {
  BakeConfig config;
  for (const double bad : {0.0, -1.0, 0.0024, 10.1, std::nan(""), std::numeric_limits<double>::infinity()}) {
    config.normal_error_degrees = bad;
    EXPECT_THROW(config.validate(), Error) << bad;
  }
  for (const double good : {0.0025, 0.04, 10.0}) {
    config.normal_error_degrees = good;
    EXPECT_NO_THROW(config.validate()) << good;
  }
  // The format can guarantee the lowest and the default error for all normals.
  EXPECT_LE(format_of(NormalEncoding::kAxis32).max_error_degrees, 0.0025);
  EXPECT_LE(format_of(NormalEncoding::kAxis24).max_error_degrees, kDefaultNormalError);
}

TEST(BakeConfig, AStatedEncodingOrErrorIsPromisedAtEveryStep) {
  BakeConfig stated_error, encoding;
  stated_error.normal_error_degrees = 0.02;
  encoding.normals = NormalEncoding::kZsign32;
  for (const double step_per_edge : {1.0 / 128.0, 1.0, std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(stated_error.normal_limits(step_per_edge).error_degrees, 0.02);
    EXPECT_EQ(stated_error.normal_limits(step_per_edge).flat_degrees, 0.02);
    EXPECT_EQ(encoding.normal_limits(step_per_edge).error_degrees,
              format_of(NormalEncoding::kZsign32).max_error_degrees);
    EXPECT_EQ(encoding.normal_limits(step_per_edge).flat_degrees, 0.1);
  }
}

TEST(BakeConfig, NormalsMayLoseMoreWhereStepsTiltFacesMore) {
  const BakeConfig config;
  for (const double fine : {0.0, 1.0 / 1024.0, kDefaultEdgeFraction}) { // the default precision and finer ones
    EXPECT_EQ(config.normal_limits(fine).error_degrees, kDefaultNormalError);
    EXPECT_EQ(config.normal_limits(fine).flat_degrees, kDefaultNormalError);
  }
  EXPECT_NEAR(config.normal_limits(1.0 / 16.0).error_degrees, 8 * kDefaultNormalError, 0.001);
  double last = 0.0;
  for (double step_per_edge = 0.001; step_per_edge < 100.0; step_per_edge *= 1.1) {
    const NormalLimits limits = config.normal_limits(step_per_edge);
    EXPECT_GE(limits.error_degrees, last);
    EXPECT_EQ(limits.flat_degrees, limits.error_degrees);
    last = limits.error_degrees;
  }
  EXPECT_LE(config.normal_limits(std::numeric_limits<double>::infinity()).error_degrees, 8.1);
}

} // namespace
} // namespace packtrace
