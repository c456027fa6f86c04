#include "compress/bake/bake_config.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "pbrt_import/scene/error.h"

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

} // namespace
} // namespace packtrace
