#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <numeric>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "runtime/ao/adaptive_rate.h"
#include "runtime/ao/ray_sorter.h"
#include "runtime/camera/primary_visibility.h"
#include "runtime/trace/source/float_source.h"
#include "tests/runtime/trace/packed_scenes.h"
#include "tests/runtime/trace/test_scenes.h"

namespace packtrace {
namespace {

AoConfig two_samples(bool falloff) {
  AoConfig config;
  config.radius = 1.5f, config.spp = 2, config.falloff = falloff;
  return config;
}

/// A thicket and the picture of it.
class RatesBench {
public:
  RatesBench() {
    const PrimaryCamera view(test::camera_at({0, 6, -9}, {0, 1, 0}), {150, 140});
    Progress progress;
    trace_primary(baked_.source, packed_, view, view, gbuffer_, progress);
  }
  AoFrame traced(const AoConfig& config, const SamplePlan& plan, uint64_t* rays = nullptr) const {
    AoFrame ao;
    Progress progress;
    const uint64_t count = trace_ao(baked_.source, packed_, gbuffer_, config, plan, ao, progress);
    if (rays != nullptr) *rays = count;
    return ao;
  }

  test::BakedScene baked_{test::thicket_scene()};
  PackedTracer packed_{baked_.file, baked_.source};
  GBuffer gbuffer_;
};

std::vector<Ray> rays_in_many_directions(size_t count) {
  std::vector<Ray> rays(count);
  for (size_t i = 0; i < count; ++i) {
    const float a = 2.4f * static_cast<float>(i), z = 1.0f - 2.0f * (static_cast<float>(i) + 0.5f) / float(count);
    const float r = std::sqrt(1.0f - z * z);
    rays[i] = {
        Vec3(static_cast<float>(i), 0, 0), 0.0f, {r * std::cos(a), r * std::sin(a), z}, i % 7 == 0 ? 0.0f : 1.0f};
  }
  return rays;
}

TEST(RaySorter, PermutesRaysWithInactiveOnesLast) {
  const std::vector<Ray> rays = rays_in_many_directions(1000);
  RaySorter sorter;
  const std::span<const Ray> sorted = sorter.sort(rays);
  std::vector<uint32_t> order(sorter.order().begin(), sorter.order().end());
  for (size_t i = 0; i < sorted.size(); ++i) EXPECT_EQ(std::memcmp(&sorted[i], &rays[order[i]], sizeof(Ray)), 0);
  const auto key = [](const Ray& ray) { return ray.tfar > 0.0f ? direction_key(ray.direction) : RaySorter::kKeys; };
  EXPECT_TRUE(std::ranges::is_sorted(sorted, {}, key));
  std::ranges::sort(order);
  for (uint32_t i = 0; i < order.size(); ++i) EXPECT_EQ(order[i], i);
}

TEST(RaySorter, KeysSeparateDirections) {
  constexpr uint32_t kMean = 100;
  std::vector<uint32_t> counts(RaySorter::kKeys);
  for (const Ray& ray : rays_in_many_directions(kMean * RaySorter::kKeys)) ++counts[direction_key(ray.direction)];
  // A point of the octahedron at the distance r from the centre, 3^-1/2 to 1, has the density r^-3 of solid angle per
  // area of the map, whose mean is 4 pi / 4.
  EXPECT_GE(std::ranges::min(counts), static_cast<uint32_t>(kMean / std::numbers::pi));
  EXPECT_LE(std::ranges::max(counts), static_cast<uint32_t>(std::ceil(kMean * std::pow(3.0, 1.5) / std::numbers::pi)));
}

TEST(AoRates, SortedRaysGiveTheSameBytes) {
  const RatesBench bench;
  for (const bool falloff : {false, true}) {
    AoConfig config = two_samples(falloff);
    uint64_t rays = 0, sorted_rays = 0;
    const AoFrame plain = bench.traced(config, {0, 2, {}, {}, {}}, &rays);
    config.sort_rays = true;
    const AoFrame sorted = bench.traced(config, {0, 2, {}, {}, {}}, &sorted_rays);
    EXPECT_EQ(plain.ao, sorted.ao);
    EXPECT_EQ(plain.hit_distance, sorted.hit_distance);
    EXPECT_EQ(rays, sorted_rays);
    EXPECT_LT(std::ranges::count(plain.ao, 1.0f), 15000) << "little is occluded";
  }
}

TEST(AoRates, CheckerboardsTraceOneColour) {
  const RatesBench bench;
  uint64_t all = 0;
  const AoFrame full = bench.traced(two_samples(true), {6, 2, {}, {}, {}}, &all);
  uint64_t sum = 0;
  for (const uint32_t colour : {0u, 1u}) {
    uint64_t rays = 0;
    const AoFrame half = bench.traced(two_samples(true), {6, 2, colour, {}, {}}, &rays);
    sum += rays;
    EXPECT_NEAR(static_cast<double>(rays), static_cast<double>(all) / 2, static_cast<double>(all) / 50);
    for (uint32_t y = 0; y < 140; ++y)
      for (uint32_t x = 0; x < 150; ++x) {
        const size_t i = y * 150 + x;
        EXPECT_EQ(half.ao[i], (x + y) % 2 == colour ? full.ao[i] : kInvalidAo);
      }
  }
  EXPECT_EQ(sum, all);
}

TEST(AoRates, PixelsGetTheNumberOfSamplesThatIsPlanned) {
  const RatesBench bench;
  const size_t pixels = bench.gbuffer_.size.pixels();
  std::vector<uint32_t> first(pixels);
  std::vector<uint16_t> count(pixels);
  for (size_t i = 0; i < pixels; ++i) first[i] = static_cast<uint32_t>(i % 5), count[i] = static_cast<uint16_t>(i % 4);
  uint64_t rays = 0, expected_rays = 0;
  const AoFrame mixed = bench.traced(two_samples(true), {0, 1, {}, first, count}, &rays);
  for (uint32_t n = 0; n < 4; ++n)
    for (uint32_t begin = 0; begin < 5; ++begin) {
      const AoFrame same = n > 0 ? bench.traced(two_samples(true), {begin, n, {}, {}, {}}) : mixed;
      for (size_t i = 0; i < pixels; ++i) {
        if (count[i] != n || first[i] != begin) continue;
        EXPECT_EQ(mixed.ao[i], n > 0 ? same.ao[i] : kInvalidAo);
        EXPECT_EQ(mixed.hit_distance[i], n > 0 ? same.hit_distance[i] : 0.0f);
        if (bench.gbuffer_.instance[i] != kNoInstance) expected_rays += n;
      }
    }
  EXPECT_EQ(rays, expected_rays);
}

/// A plane that fills the picture, moved by `motion` pixels since the previous frame.
GBuffer moved_plane(float motion) {
  GBuffer g;
  g.resize({64, 32});
  g.view_z.assign(64 * 32, 5.0f), g.instance.assign(64 * 32, 0), g.motion_px.assign(64 * 32, Vec2(motion, 0));
  return g;
}

uint64_t sum_of(const SamplePlan& plan) {
  return std::accumulate(plan.pixel_count.begin(), plan.pixel_count.end(), uint64_t{0});
}

TEST(AdaptiveRate, NewSurfacesGetMoreSamplesOfTheSameBudget) {
  AdaptiveRate rate;
  for (int frame = 0; frame < 20; ++frame) {
    const SamplePlan plan = rate.next_frame(moved_plane(0), false, 1);
    EXPECT_NEAR(static_cast<double>(sum_of(plan)), 64 * 32, 0) << frame;
  }
  // 4 columns come into view at the left.
  const SamplePlan plan = rate.next_frame(moved_plane(4), false, 1);
  EXPECT_LE(sum_of(plan), 64u * 32u * 102 / 100);
  uint64_t young = 0, old = 0;
  for (size_t i = 0; i < 64 * 32; ++i) (i % 64 < 4 ? young : old) += plan.pixel_count[i];
  EXPECT_EQ(young, 2u * 4 * 32);
  EXPECT_GT(old, 60u * 32 * 9 / 10);
}

TEST(AdaptiveRate, EveryPixelGetsASampleWithinFourFrames) {
  AdaptiveRate rate;
  for (int frame = 0; frame < 12; ++frame) rate.next_frame(moved_plane(0), false, 1);
  std::vector<uint32_t> samples(64 * 32);
  for (int frame = 0; frame < 6; ++frame) {
    const SamplePlan plan = rate.next_frame(moved_plane(8), false, 1); // much comes into view
    for (size_t i = 0; i < samples.size(); ++i) samples[i] += plan.pixel_count[i];
  }
  EXPECT_GT(std::ranges::min(samples), 0u);
}

TEST(AdaptiveRate, ForgetsSurfacesOfAnotherDepthOrInstance) {
  AdaptiveRate rate;
  for (int frame = 0; frame < 12; ++frame) rate.next_frame(moved_plane(0), false, 1);
  GBuffer other = moved_plane(0);
  other.view_z[100] = 6.0f, other.instance[200] = 1;
  const SamplePlan plan = rate.next_frame(other, false, 1);
  for (const size_t i : {100u, 200u}) EXPECT_EQ(plan.pixel_count[i], 2u);
  EXPECT_EQ(rate.ages()[100], 1u);
  EXPECT_EQ(rate.ages()[101], 13u);
}

TEST(AdaptiveRate, SurfacesWhoseOcclusionChangesGetMoreSamples) {
  AdaptiveRate rate;
  for (int frame = 0; frame < 12; ++frame) rate.next_frame(moved_plane(0), false, 1);
  std::vector<float> limits(64 * 32, 1e30f);
  limits[100] = 0.3f, limits[200] = 3.9f, limits[300] = 1.9f;
  const SamplePlan plan = rate.next_frame(moved_plane(0), false, 1, limits);
  EXPECT_EQ(plan.pixel_count[100], 2u);
  EXPECT_EQ(plan.pixel_count[300], 2u);
  EXPECT_LE(plan.pixel_count[200], 1u);
  EXPECT_GE(rate.ages()[200], 3u);
  EXPECT_EQ(rate.ages()[101], 13u);
}

TEST(AdaptiveRate, ContinuesFromASavedState) {
  AdaptiveRate whole, part;
  for (int frame = 0; frame < 5; ++frame) whole.next_frame(moved_plane(0.7f), false, 2);
  ASSERT_TRUE(part.restore({64, 32}, whole.save()));
  const SamplePlan a = whole.next_frame(moved_plane(3), false, 2), b = part.next_frame(moved_plane(3), false, 2);
  EXPECT_TRUE(std::ranges::equal(a.pixel_count, b.pixel_count));
  EXPECT_TRUE(std::ranges::equal(a.pixel_first, b.pixel_first));
  EXPECT_FALSE(part.restore({64, 31}, whole.save()));
}

} // namespace
} // namespace packtrace
