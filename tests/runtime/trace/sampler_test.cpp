#include "runtime/ao/sampler.h"

#include <set>

#include "runtime/ao/hemisphere.h"
#include "runtime/ao/multi_jitter.h"

#include <gtest/gtest.h>

namespace packtrace {
namespace {

const SamplerKind kKinds[] = {SamplerKind::kSpaceTimeNet, SamplerKind::kPixelSobol, SamplerKind::kMultiJitter,
                              SamplerKind::kLattice, SamplerKind::kIndependent};

/// True if every elementary box of a (0, k, 2)-net in base 2 holds exactly one of the 2^k points.
bool is_net(const std::vector<Vec2>& points) {
  const auto count = static_cast<uint32_t>(points.size());
  for (uint32_t columns = 1; columns <= count; columns *= 2) {
    const uint32_t rows = count / columns;
    std::set<uint32_t> boxes;
    for (const Vec2 p : points)
      boxes.insert(static_cast<uint32_t>(p.x * float(columns)) * rows + static_cast<uint32_t>(p.y * float(rows)));
    if (boxes.size() != count) return false;
  }
  return true;
}

/// Points of an aligned block of pixels for consecutive samples.
std::vector<Vec2> block_points(const PixelSampler& sampler, uint32_t x0, uint32_t y0, uint32_t size, uint64_t first,
                               uint64_t count) {
  std::vector<Vec2> points;
  for (uint64_t n = first; n < first + count; ++n)
    for (uint32_t y = y0; y < y0 + size; ++y)
      for (uint32_t x = x0; x < x0 + size; ++x)
        points.push_back(sampler.point(sampler.pixel(x, y), static_cast<uint32_t>(n)));
  return points;
}

TEST(PixelSampler, EveryPixelIsANetOverTime) {
  for (const SamplerKind kind : {SamplerKind::kSpaceTimeNet, SamplerKind::kPixelSobol}) {
    const PixelSampler sampler(kind, 7);
    for (const uint64_t count : {2u, 4u, 8u, 16u, 32u, 64u, 256u, 1024u})
      EXPECT_TRUE(is_net(block_points(sampler, 13, 5, 1, 3 * count, count))) << count;
    // Past the end of the sequence, where it is scrambled anew.
    EXPECT_TRUE(is_net(block_points(sampler, 13, 5, 1, 65536 + 64, 64)));
  }
}

TEST(PixelSampler, AlignedPixelBlocksAreNetsInEveryFrame) {
  const PixelSampler sampler(SamplerKind::kSpaceTimeNet, 1);
  for (const uint64_t frame : {0u, 1u, 17u, 1000u}) {
    EXPECT_TRUE(is_net(block_points(sampler, 8, 24, 8, frame, 1)));
    EXPECT_TRUE(is_net(block_points(sampler, 4, 8, 4, frame, 1)));
    EXPECT_TRUE(is_net(block_points(sampler, 2, 6, 2, frame, 1)));
  }
}

TEST(PixelSampler, BlocksAndFramesTogetherAreNets) {
  const PixelSampler sampler(SamplerKind::kSpaceTimeNet, 99);
  EXPECT_TRUE(is_net(block_points(sampler, 2, 4, 2, 8, 4)));
  EXPECT_TRUE(is_net(block_points(sampler, 4, 4, 4, 16, 16)));
  EXPECT_TRUE(is_net(block_points(sampler, 8, 0, 8, 64, 64)));
}

TEST(PixelSampler, PointsLieInTheUnitSquareAndFillIt) {
  for (const SamplerKind kind : kKinds) {
    const PixelSampler sampler(kind, 3);
    double sum_x = 0, sum_y = 0, sum_xy = 0;
    for (const Vec2 p : block_points(sampler, 0, 0, 64, 5, 4)) {
      ASSERT_TRUE(p.x >= 0.0f && p.x < 1.0f && p.y >= 0.0f && p.y < 1.0f);
      sum_x += p.x, sum_y += p.y, sum_xy += p.x * p.y;
    }
    const double n = 64 * 64 * 4;
    EXPECT_NEAR(sum_x / n, 0.5, 0.01);
    EXPECT_NEAR(sum_y / n, 0.5, 0.01);
    EXPECT_NEAR(sum_xy / n, 0.25, 0.01);
  }
}

TEST(PixelSampler, SeedsPixelsAndSamplesAllMatter) {
  for (const SamplerKind kind : kKinds) {
    const PixelSampler a(kind, 1), b(kind, 2), c(kind, uint64_t{1} << 32);
    std::set<std::pair<float, float>> distinct;
    const auto add = [&](Vec2 p) { distinct.insert({p.x, p.y}); };
    add(a.point(a.pixel(1, 2), 0));
    add(b.point(b.pixel(1, 2), 0));
    add(c.point(c.pixel(1, 2), 0));
    add(a.point(a.pixel(2, 1), 0));
    add(a.point(a.pixel(1, 2), 1));
    add(a.point(a.pixel(1, 2), 65536));
    EXPECT_EQ(distinct.size(), 6u);
  }
}

TEST(PixelSampler, BlocksAreDecorrelated) {
  for (const SamplerKind kind : {SamplerKind::kSpaceTimeNet, SamplerKind::kMultiJitter}) {
    const PixelSampler sampler(kind, 0);
    std::set<std::pair<uint32_t, uint32_t>> seeds;
    for (uint32_t y = 0; y < 135; ++y)
      for (uint32_t x = 0; x < 240; ++x) {
        const PixelSampler::Pixel pixel = sampler.pixel(8 * x, 8 * y);
        seeds.insert({pixel.seed_x, pixel.seed_y});
      }
    EXPECT_GE(seeds.size(), 240u * 135u * 99 / 100);
  }
}

TEST(PixelSampler, ArraysHoldThePointsOfTheirPixels) {
  constexpr uint32_t kCount = 37;
  std::vector<uint32_t> x, y, samples;
  for (uint32_t i = 0; i < kCount; ++i) x.push_back(11 * i), y.push_back(i * i), samples.push_back(70001 * i);
  for (const SamplerKind kind : kKinds) {
    const PixelSampler sampler(kind, 5);
    PixelSampler::Pixels pixels;
    pixels.resize(kCount);
    sampler.pixels(x.data(), y.data(), kCount, pixels);
    std::vector<float> u(kCount), v(kCount);
    sampler.points(pixels, samples.data(), kCount, u.data(), v.data());
    for (uint32_t i = 0; i < kCount; ++i)
      EXPECT_EQ(Vec2(u[i], v[i]), sampler.point(sampler.pixel(x[i], y[i]), samples[i]));
  }
}

/// Numbers of points in the cells of a grid of columns x rows.
std::vector<uint32_t> cell_counts(const std::vector<Vec2>& points, uint32_t columns, uint32_t rows) {
  std::vector<uint32_t> counts(size_t{columns} * rows);
  for (const Vec2 p : points)
    ++counts[static_cast<uint32_t>(p.y * float(rows)) * columns + static_cast<uint32_t>(p.x * float(columns))];
  return counts;
}

TEST(MultiJitter, EachSetHasOnePointPerCellRowAndColumn) {
  for (const MultiJitterSet& set : multi_jitter_sets()) {
    const std::vector<Vec2> points(set.begin(), set.end());
    for (const auto& [columns, rows] : {std::pair{8u, 8u}, {64u, 1u}, {1u, 64u}})
      for (const uint32_t count : cell_counts(points, columns, rows)) EXPECT_EQ(count, 1u);
  }
}

TEST(MultiJitter, BlocksOfPixelsShareASet) {
  const PixelSampler sampler(SamplerKind::kMultiJitter, 3);
  for (const uint64_t frame : {0u, 1u, 100u})
    for (const uint32_t count : cell_counts(block_points(sampler, 16, 8, 8, frame, 1), 8, 8)) EXPECT_EQ(count, 1u);
  for (const uint32_t side : {1u, 2u, 4u}) { // smaller blocks use a set up in several samples
    const PixelSampler small(SamplerKind::kMultiJitter, 3, side);
    const uint64_t per_set = kSetPoints / (side * side);
    for (const uint32_t count : cell_counts(block_points(small, 8, 16, side, 5 * per_set, per_set), 8, 8))
      EXPECT_EQ(count, 1u) << side;
  }
}

TEST(PixelSampler, HeightsHaveTheMeanOfACosineInEveryFrame) {
  for (const SamplerKind kind : kKinds)
    for (const uint64_t frame : {0u, 3u, 1000u}) {
      const PixelSampler sampler(kind, 2);
      double sum = 0.0;
      for (const Vec2 p : block_points(sampler, 0, 0, 64, frame, 1)) sum += double{cosine_direction(p).z};
      EXPECT_NEAR(sum / (64 * 64), 2.0 / 3.0, 0.01) << static_cast<int>(kind) << ", frame " << frame;
    }
}

TEST(MultiJitter, HeightsHaveTheMeanOfACosine) {
  for (uint32_t side = 1; side <= 8; ++side) {
    const PixelSampler sampler(SamplerKind::kMultiJitter, 1, side);
    double sum = 0.0;
    for (const Vec2 p : block_points(sampler, 0, 0, 56, 2, 2)) sum += cosine_direction(p).z;
    EXPECT_NEAR(sum / (56 * 56 * 2), 2.0 / 3.0, 0.01) << side;
  }
}

/// Mean squared error of the mean height over windows of 7 x 7 pixels at one sample number.
double window_error(const PixelSampler& sampler) {
  double sum = 0.0, count = 0.0;
  for (uint32_t y = 0; y < 400; y += 5)
    for (uint32_t x = 0; x < 400; x += 5) {
      double mean = 0.0;
      for (const Vec2 p : block_points(sampler, x, y, 7, 3, 1)) mean += cosine_direction(p).z / 49.0;
      sum += (mean - 2.0 / 3.0) * (mean - 2.0 / 3.0), count += 1.0;
    }
  return sum / count;
}

TEST(MultiJitter, WindowsAcrossBlocksErrLessThanThoseOfIndependentPoints) {
  const double independent = window_error(PixelSampler(SamplerKind::kIndependent, 1));
  EXPECT_NEAR(independent, 1.0 / 18.0 / 49.0, 1e-4); // the variance of a cosine-weighted height is 1/18
  EXPECT_LT(window_error(PixelSampler(SamplerKind::kMultiJitter, 1)), 0.9 * independent);
}

TEST(CosineDirection, IsUnitAndCosineWeighted) {
  const PixelSampler sampler(SamplerKind::kPixelSobol, 4);
  Vec3 sum(0);
  double z_squared = 0;
  constexpr uint32_t kCount = 16384;
  for (uint32_t n = 0; n < kCount; ++n) {
    const Vec3 d = cosine_direction(sampler.point(sampler.pixel(0, 0), n));
    ASSERT_NEAR(glm::length(d), 1.0f, 1e-6f);
    ASSERT_GE(d.z, 0.0f);
    sum += d;
    z_squared += d.z * d.z;
  }
  EXPECT_NEAR(sum.x / kCount, 0.0, 1e-3);
  EXPECT_NEAR(sum.y / kCount, 0.0, 1e-3);
  EXPECT_NEAR(sum.z / kCount, 2.0 / 3.0, 1e-3);
  EXPECT_NEAR(z_squared / kCount, 0.5, 1e-3);
}

TEST(CosineDirection, HandlesTheSquaresCornersAndCentre) {
  for (const Vec2 p : {Vec2(0, 0), Vec2(0x1.fffffep-1f, 0), Vec2(0, 0x1.fffffep-1f), Vec2(0.5f, 0.5f)})
    EXPECT_NEAR(glm::length(cosine_direction(p)), 1.0f, 1e-6f);
  EXPECT_EQ(cosine_direction({0.5f, 0.5f}).z, 1.0f);
}

} // namespace
} // namespace packtrace
