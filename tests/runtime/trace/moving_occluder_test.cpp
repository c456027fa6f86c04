#include <cstdio>

#include <gtest/gtest.h>

#include "runtime/ao/ao_integrator.h"
#include "runtime/camera/primary_visibility.h"
#include "runtime/denoise/denoiser.h"
#include "tests/runtime/trace/moving_scenes.h"

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
  void trace(uint32_t frame, uint32_t spp, const std::vector<Affine>& before, GBuffer& g, AoFrame& ao) {
    Progress progress;
    const PrimaryCamera camera(test::camera_at({0, 3, -9}, {0, 0, 0}, 50), kImage);
    trace_primary(baked_.source, tracer_, camera, {camera, before}, g, progress);
    ao_.spp = spp;
    trace_ao(baked_.source, tracer_, g, ao_, frame, ao, progress);
  }

  static constexpr uint32_t kBox = 2; ///< instance
  static inline const DVec3 kLow{0, 0.8, 0}, kHigh{0, 9, 0};
  const test::BakedScene baked_{scene()};
  const Movers movers_{{kBox}, {{-3, -1, -3}, {3, 12, 3}}};
  PackedTracer tracer_{baked_.file, baked_.source, chosen_isa(), movers_};
  AoConfig ao_;
};

/// Mean difference from the truth over the pixels of floor and wall whose truth changed by more than 0.1 and that were
/// seen before: what remains of the occluder is its signed mean.
struct Ghost {
  double signed_mean = 0.0, absolute_mean = 0.0;
};

TEST_F(OccluderTest, LeavesLittleOcclusionBehind) {
  GBuffer g;
  AoFrame truth_before, truth_after, noisy;
  const std::vector<Affine> low{Affine(1.0f), Affine(1.0f), Affine(test::placed(kLow))},
      high{Affine(1.0f), Affine(1.0f), Affine(test::placed(kHigh))};
  trace(1000, 256, low, g, truth_before);
  const std::vector<uint32_t> seen_before = g.instance;
  AoDenoiser denoiser, reset;
  for (uint32_t f = 0; f < kBefore; ++f) {
    trace(f, 1, low, g, noisy);
    denoiser.next_frame(g, noisy);
  }
  place(kHigh);
  trace(2000, 256, high, g, truth_after);
  const auto ghost = [&](const DenoisedAo& result) {
    Ghost sum;
    size_t count = 0;
    for (size_t i = 0; i < kImage.pixels(); ++i) {
      if (g.instance[i] >= kBox || seen_before[i] != g.instance[i] ||
          std::abs(truth_before.ao[i] - truth_after.ao[i]) < 0.1f)
        continue;
      const double error = double{result.ao[i]} - double{truth_after.ao[i]};
      sum.signed_mean += error, sum.absolute_mean += std::abs(error), ++count;
    }
    EXPECT_GT(count, 1000u);
    return Ghost{sum.signed_mean / static_cast<double>(count), sum.absolute_mean / static_cast<double>(count)};
  };
  for (uint32_t f = 0; f < kAfter; ++f) {
    trace(kBefore + f, 1, f == 0 ? low : high, g, noisy);
    const Ghost kept = ghost(denoiser.next_frame(g, noisy)), anew = ghost(reset.next_frame(g, noisy));
    const uint32_t frames = f + 1;
    if (frames == 1 || frames == 2 || frames == 4 || frames == 8 || frames == 16)
      std::printf("%2u frames after: error %.4f (mean %+.4f), of a reset denoiser %.4f (mean %+.4f)\n", frames,
                  kept.absolute_mean, kept.signed_mean, anew.absolute_mean, anew.signed_mean);
    if (frames == 4) {
      EXPECT_LT(std::abs(kept.signed_mean), 0.2);
    }
    if (frames == 16) {
      EXPECT_LT(std::abs(kept.signed_mean), 0.05);
    }
  }
}

} // namespace
} // namespace packtrace
