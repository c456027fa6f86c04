#include "compress/format/cluster/position_grid.h"

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

TEST(PositionGrid, StepIsTheLargestAllowedOne) {
  for (const double wanted : {1.0, 0.3, 7.7e-30, 9.99e29, 1.0 / 3.0, 1.4e-45 / 128}) {
    const PositionGrid grid = choose_position_grid(wanted);
    EXPECT_GE(grid.mantissa, kMinStepMantissa);
    EXPECT_LE(grid.mantissa, kMaxStepMantissa);
    EXPECT_LE(grid.step(), wanted);
    EXPECT_GT(grid.step(), wanted * 8.0 / 9.0);
  }
  EXPECT_EQ(choose_position_grid(0.75), (PositionGrid{12, -4}));
}

TEST(PositionGrid, RefusesStepsThatAreNoStep) {
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::infinity(), std::nan(""), 1e-305, 1e300})
    EXPECT_THROW(choose_position_grid(bad), Error) << bad;
}

TEST(PositionGrid, DecodeIsExactWhileMantissaAndLatticeFitAFloat) {
  const double step = PositionGrid{8, -10}.step();
  for (const int64_t q : {int64_t{0}, int64_t{1}, int64_t{-77777}, int64_t{1} << 24})
    EXPECT_EQ(static_cast<double>(from_lattice(q, step)), static_cast<double>(q) * step);
}

TEST(PositionGrid, DecodeIsMonotone) {
  for (const PositionGrid grid : {PositionGrid{9, -13}, PositionGrid{15, -140}, PositionGrid{11, 60}}) {
    for (const int64_t base : {int64_t{0}, int64_t{1} << 24, (int64_t{1} << 53) - 50, int64_t{-123456789}}) {
      float previous = from_lattice(base, grid.step());
      for (int64_t q = base + 1; q < base + 200; ++q) {
        const float p = from_lattice(q, grid.step());
        EXPECT_LE(previous, p);
        previous = p;
      }
    }
  }
}

TEST(PositionGrid, ErrorStaysWithinItsBoundAtEveryScale) {
  test::Random random(1);
  for (const double scale : {1e-44, 1e-38, 1e-30, 1e-6, 1.0, 1e6, 1e30}) {
    for (const double step_over_scale : {1e-3, 1e-7, 3e-9}) { // from far above the float's ulp to far below it
      const double step = choose_position_grid(scale * step_over_scale).step();
      for (int i = 0; i < 2000; ++i) {
        const double p = static_cast<double>(random.uniform(-1, 1)) * scale;
        const double decoded = from_lattice(to_lattice(p, step), step);
        EXPECT_LE(std::abs(decoded - p), position_error_bound(step, scale));
      }
    }
  }
}

TEST(PositionGrid, BoundIsHalfAStepNearTheOrigin) {
  EXPECT_NEAR(position_error_bound(0.25, 1.0), 0.125, 1e-6);
  EXPECT_GT(position_error_bound(0.25, 1.0), 0.125);
}

} // namespace
} // namespace packtrace
