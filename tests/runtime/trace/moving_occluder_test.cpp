#include <bit>
#include <cstdio>
#include <limits>

#include <gtest/gtest.h>

#include "runtime/ao/ao_integrator.h"
#include "runtime/ao/moved_occluders.h"
#include "runtime/camera/primary_visibility.h"
#include "runtime/denoise/denoiser.h"
#include "tests/runtime/trace/moving_scenes.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

constexpr ImageSize kImage{200, 150};
constexpr uint32_t kBefore = 48; ///< frames with the occluder in its first place
constexpr uint32_t kAfter = 16;

/// A floor, a wall that keeps part of it occluded, and a box that rises far above them.
class OccluderTest : public testing::Test {
protected:
  static Scene scene() {
    Scene scene;
    test::add_shape(scene, test::quad({-20, 0, -20}, {0, 0, 40}, {40, 0, 0}));
    test::add_shape(scene, test::quad({-20, 0, 2.5f}, {40, 0, 0}, {0, 6, 0}));
    test::add_object(scene, test::box({-1.5f, -0.5f, -1.5f}, {1.5f, 0.5f, 1.5f}));
    scene.instances.push_back({0, Affine(test::placed(kLow))});
    return scene;
  }

  OccluderTest() {
    ao_.radius = 3.0f;
    ao_.falloff = false;
  }

  void place(DVec3 at) { tracer_.place_instances(std::vector<uint32_t>{kBox}, std::vector{Affine(test::placed(at))}); }

  /// Traces one frame; the camera looks down and sees the floor around the box, and later below it.
  void trace(uint32_t frame, uint32_t spp, DVec3 before, DVec3 now, GBuffer& g, AoFrame& ao) {
    Progress progress;
    const PrimaryCamera camera(test::camera_at({0, 3, -9}, {0, 0, 0}, 50), kImage);
    const std::vector<Affine> last{Affine(1.0f), Affine(1.0f), Affine(test::placed(before))};
    place(now);
    trace_primary(baked_.source, tracer_, camera, {camera, last}, g, progress);
    ao_.spp = spp;
    trace_ao(baked_.source, tracer_, g, ao_, frame, ao, progress);
  }

  /// Limits the history as the frame loop does.
  void limit(DVec3 before, DVec3 now, const GBuffer& g, AoFrame& ao) const {
    if (before == now) return;
    const Bounds box{{-1.5, -0.5, -1.5}, {1.5, 0.5, 1.5}};
    const MovedBox moved = moved_box(kBox, box, DAffine(test::placed(before)), box, DAffine(test::placed(now)));
    ao.max_history = history_limits({&moved, 1}, g, ao_, ao_.radius);
  }

  static constexpr uint32_t kBox = 2; ///< instance
  static inline const DVec3 kLow{0, 0.8, 0}, kHigh{0, 9, 0};
  const test::BakedScene baked_{scene()};
  const Movers movers_{{kBox}, {{-6, -1, -3}, {6, 12, 3}}};
  PackedTracer tracer_{baked_.file, baked_.source, chosen_isa(), movers_};
  AoConfig ao_;
};

/// Mean difference from the truth over some pixels; what remains of the occluder is its signed mean.
struct Ghost {
  double signed_mean = 0.0, absolute_mean = 0.0;
};

Ghost ghost_of(const DenoisedAo& result, const AoFrame& truth, const std::vector<size_t>& pixels) {
  Ghost sum;
  for (const size_t i : pixels) {
    const double error = double{result.ao[i]} - double{truth.ao[i]};
    sum.signed_mean += error, sum.absolute_mean += std::abs(error);
  }
  const auto count = static_cast<double>(pixels.size());
  return {sum.signed_mean / count, sum.absolute_mean / count};
}

/// The pixels of floor and wall.
std::vector<size_t> still_pixels(const GBuffer& g, uint32_t box) {
  std::vector<size_t> pixels;
  for (size_t i = 0; i < g.instance.size(); ++i)
    if (g.instance[i] < box) pixels.push_back(i);
  return pixels;
}

TEST_F(OccluderTest, LeavesLittleOcclusionBehind) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  GBuffer g;
  AoFrame truth_before, truth, noisy;
  trace(1000, 256, kLow, kLow, g, truth_before);
  const std::vector<uint32_t> seen_before = g.instance;
  DenoiserConfig reference;
  reference.kind = DenoiserKind::kReference;
  for (const DenoiserConfig& config : {DenoiserConfig(), reference}) {
    AoDenoiser unlimited(config), limited(config), reset(config);
    for (uint32_t f = 0; f < kBefore; ++f) {
      trace(f, 1, kLow, kLow, g, noisy);
      unlimited.next_frame(g, noisy), limited.next_frame(g, noisy);
    }
    trace(2000, 256, kHigh, kHigh, g, truth);
    std::vector<size_t> changed; // seen before
    for (const size_t i : still_pixels(g, kBox))
      if (seen_before[i] == g.instance[i] && std::abs(truth_before.ao[i] - truth.ao[i]) >= 0.1f) changed.push_back(i);
    ASSERT_GT(changed.size(), 1000u);
    for (uint32_t f = 0; f < kAfter; ++f) {
      const DVec3 last = f == 0 ? kLow : kHigh;
      trace(kBefore + f, 1, last, kHigh, g, noisy);
      const double free = ghost_of(unlimited.next_frame(g, noisy), truth, changed).absolute_mean;
      const double anew = ghost_of(reset.next_frame(g, noisy), truth, changed).absolute_mean;
      limit(last, kHigh, g, noisy);
      const Ghost kept = ghost_of(limited.next_frame(g, noisy), truth, changed);
      if (!std::has_single_bit(f + 1)) continue;
      std::printf("%s, %2u frames after: error %.4f (mean %+.4f), without limits %.4f, reset %.4f\n",
                  config.kind == DenoiserKind::kReference ? "reference" : "ours", f + 1, kept.absolute_mean,
                  kept.signed_mean, free, anew);
      EXPECT_LT(kept.absolute_mean, anew + 0.006) << f;
      if (f == 0) {
        EXPECT_LT(kept.absolute_mean, free / 4);
      }
      if (f + 1 == kAfter) {
        EXPECT_LT(std::abs(kept.signed_mean), config.kind == DenoiserKind::kReference ? 0.02 : 0.003);
      }
    }
  }
}

/// Mean errors of the last frames while the box slides.
struct SlidingErrors {
  double unlimited = 0.0, limited = 0.0, reset = 0.0;
};

TEST_F(OccluderTest, MovesOnWithItsOcclusion) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  GBuffer g;
  AoFrame truth, noisy;
  constexpr uint32_t kStart = 24, kFirst = 40, kEnd = 48;
  for (const double step : {0.01, 0.1}) {
    AoDenoiser unlimited, limited;
    SlidingErrors errors;
    DVec3 last = kLow;
    for (uint32_t f = 0; f < kEnd; ++f) {
      const DVec3 now = kLow + DVec3(step * (f > kStart ? f - kStart : 0), 0, 0);
      if (f >= kFirst) trace(5000, 64, now, now, g, truth);
      trace(f, 1, last, now, g, noisy);
      AoDenoiser reset;
      const DenoisedAo &free = unlimited.next_frame(g, noisy), &anew = reset.next_frame(g, noisy);
      limit(last, now, g, noisy);
      const DenoisedAo& kept = limited.next_frame(g, noisy);
      last = now;
      if (f < kFirst) continue;
      const std::vector<size_t> pixels = still_pixels(g, kBox);
      errors.unlimited += ghost_of(free, truth, pixels).absolute_mean / (kEnd - kFirst);
      errors.limited += ghost_of(kept, truth, pixels).absolute_mean / (kEnd - kFirst);
      errors.reset += ghost_of(anew, truth, pixels).absolute_mean / (kEnd - kFirst);
    }
    std::printf("%.2f a frame: error %.4f, without limits %.4f, reset %.4f\n", step, errors.limited, errors.unlimited,
                errors.reset);
    EXPECT_LT(errors.limited, errors.unlimited * (step < 0.05 ? 1.03 : 0.75)); // slow: as good as without limits
    if (step < 0.05) {
      EXPECT_LT(errors.limited, 0.8 * errors.reset);
    }
  }
}

/// One pixel that shows a point of a floor.
class HistoryLimit : public testing::Test {
protected:
  HistoryLimit() {
    g_.resize({1, 1});
    g_.normal[0] = g_.geometric_normal[0] = Vec3(0, 1, 0);
    g_.instance[0] = 0;
  }

  float limit(DVec3 before, DVec3 now, uint32_t instance = 7) {
    const Bounds box{DVec3(-0.5), DVec3(0.5)};
    const MovedBox moved = moved_box(instance, box, DAffine(test::placed(before)), box, DAffine(test::placed(now)));
    AoConfig config;
    config.falloff = false;
    return history_limits({&moved, 1}, g_, config, 4.0f).at(0);
  }

  static constexpr float kNone = std::numeric_limits<float>::max();
  GBuffer g_;
};

TEST_F(HistoryLimit, IsShortWhereABoxCoversMuchMoreOrLess) {
  const float gone = limit({0, 1, 0}, {0, 90, 0});
  EXPECT_LT(gone, 0.05f);
  EXPECT_FLOAT_EQ(limit({0, 90, 0}, {0, 1, 0}), gone);
  EXPECT_GT(limit({0, 3, 0}, {0, 90, 0}), 5.0f * gone); // covers a tenth of the area
  EXPECT_GT(limit({0, 1, 0}, {0, 1.05, 0}), 10.0f * gone);
}

TEST_F(HistoryLimit, IsNoneForBoxesThatOccludeNothing) {
  EXPECT_EQ(limit({0, 4.6, 0}, {0, 5, 0}), kNone);      // beyond the radius
  EXPECT_EQ(limit({0, -0.6, 0}, {0, -9, 0}), kNone);    // below the surface
  EXPECT_EQ(limit({1, 0.5, 0}, {2, 0.5, 0}, 0), kNone); // the surface's own
  EXPECT_EQ(limit({3, 0.5, 0}, {3, 0.5001, 0}), kNone); // hardly moved
  g_.instance[0] = kNoInstance;
  EXPECT_EQ(limit({0, 1, 0}, {0, 90, 0}), kNone);
}

TEST_F(HistoryLimit, DoesNotExistWithoutMovement) { EXPECT_TRUE(history_limits({}, g_, AoConfig(), 1.0f).empty()); }

} // namespace
} // namespace packtrace
