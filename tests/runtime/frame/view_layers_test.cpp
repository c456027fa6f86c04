// Layers of intermediate results.

#include "runtime/frame/view_layers.h"

#include <cmath>

#include <gtest/gtest.h>

#include "runtime/frame/still.h"
#include "runtime/trace/source/float_source.h"
#include "tests/runtime/denoise/synthetic.h"
#include "tests/runtime/trace/test_scenes.h"

namespace packtrace {
namespace {

/// A floor seen from above, and a frame loop with views.
class ViewBench {
public:
  explicit ViewBench(bool denoise = true, AoResolution resolution = AoResolution::kFull, uint32_t supersample = 1) {
    test::add_shape(scene_, test::quad(Vec3(-4, 0, -4), Vec3(0, 0, 8), Vec3(8, 0, 0)));
    test::add_shape(scene_, test::box(Vec3(-1, 0, -1), Vec3(1, 1, 1)));
    source_ = std::make_unique<FloatSource>(scene_);
    FrameConfig config;
    config.size = {48, 32};
    config.supersample = supersample;
    config.view_layers = true;
    config.jitter = false;
    config.denoise = denoise;
    config.ao_resolution = resolution;
    config.ao.radius = 1.0f;
    loop_ = std::make_unique<FrameLoop>(FrameScene{source_.get(), nullptr, {}}, config);
  }

  /// The image of some frames of a camera.
  RenderedImage image(double x, uint32_t frames) {
    RenderedImage result;
    Progress progress;
    render_picture(*loop_, test::camera_at(DVec3(x, 5, -6), DVec3(x, 0, 0), 50.0), 0.0, frames, result, progress);
    return result;
  }

private:
  Scene scene_;
  std::unique_ptr<FloatSource> source_;
  std::unique_ptr<FrameLoop> loop_;
};

float largest(const std::vector<float>& values) { return *std::ranges::max_element(values); }

TEST(ViewLayers, AreEmptyUnlessAskedFor) {
  FrameConfig config;
  EXPECT_FALSE(config.view_layers);
  ViewBench raw(false);
  const RenderedImage image = raw.image(0.0, 2);
  EXPECT_FALSE(image.hit_distance.empty() || image.motion.empty() || image.local_variance.empty());
  EXPECT_TRUE(image.variance.empty() && image.history.empty() && image.disocclusion.empty()) << "no denoiser";
}

TEST(ViewLayers, MotionLeadsToWhereThePreviousImageShowsTheSurface) {
  ViewBench bench;
  const RenderedImage first = bench.image(0.0, 3), second = bench.image(0.05, 3), third = bench.image(0.05, 3);
  size_t compared = 0;
  for (uint32_t y = 4; y < 28; ++y)
    for (uint32_t x = 8; x < 40; ++x) {
      const size_t at = size_t{y} * 48 + x;
      EXPECT_EQ(first.motion[at], Vec2(0));
      EXPECT_EQ(third.motion[at], Vec2(0)) << "nothing moved any more";
      if (second.coverage[at] < 1.0f) continue;
      ++compared;
      EXPECT_LT(second.motion[at].x, -0.05f) << "the camera moved to the right";
      EXPECT_NEAR(second.motion[at].y, 0.0f, 0.02f);
      EXPECT_NEAR(second.previous_depth[at], second.depth[at], 0.02f * second.depth[at]);
    }
  EXPECT_GT(compared, 500u);
}

TEST(ViewLayers, HistoryCountsFramesAndDisocclusionShowsWhereItBegan) {
  ViewBench bench;
  const RenderedImage first = bench.image(0.0, 4), second = bench.image(0.3, 2);
  for (size_t i = 0; i < first.history.size(); ++i)
    if (first.coverage[i] > 0.0f) {
      EXPECT_EQ(first.history[i], 4.0f);
      EXPECT_EQ(first.disocclusion[i], 1.0f) << "all histories begin here";
    }
  EXPECT_GT(largest(second.history), 4.0f);
  double disoccluded = 0.0, hits = 0.0;
  for (size_t i = 0; i < second.coverage.size(); ++i)
    if (second.coverage[i] > 0.0f) hits += 1.0, disoccluded += static_cast<double>(second.disocclusion[i]);
  EXPECT_GT(disoccluded, 0.0);
  EXPECT_LT(disoccluded, 0.3 * hits);
}

TEST(ViewLayers, DistancesEndAtTheRadiusAndNoiseIsWhereShadowsAre) {
  for (const auto& [resolution, supersample] :
       {std::pair{AoResolution::kFull, 1u}, {AoResolution::kFull, 2u}, {AoResolution::kQuarter, 1u}}) {
    ViewBench bench(true, resolution, supersample);
    const RenderedImage image = bench.image(0.0, 1);
    EXPECT_LE(largest(image.hit_distance), 1.0f + 1e-6f);
    EXPECT_GT(largest(image.hit_distance), 0.99f);
    EXPECT_GT(largest(image.local_variance), 0.01f);
    EXPECT_LT(largest(image.local_variance), 0.3f);
    EXPECT_GT(largest(image.variance), 0.0f);
    EXPECT_EQ(image.history.size(), image.ao.size());
  }
}

TEST(LocalVariance, IsThatOfTheSamplesInTheWindow) {
  constexpr ImageSize kSize{16, 16};
  AoFrame frame = synthetic::samples(kSize, [](uint32_t x, uint32_t) { return x % 2 == 0 ? 0.0f : 1.0f; });
  frame.ao[8 * 16 + 8] = kInvalidAo;
  const std::vector<float> variance = local_variance(frame);
  EXPECT_EQ(variance[8 * 16 + 8], 0.0f);
  // Around (7, 8): 3 x 7 ones, 4 x 7 - 1 zeros.
  constexpr float kOnes = 21.0f, kZeros = 27.0f, kCount = kOnes + kZeros;
  EXPECT_NEAR(variance[8 * 16 + 7], kOnes * kZeros / kCount / (kCount - 1.0f), 1e-6f);
  EXPECT_EQ(local_variance(synthetic::samples(kSize, [](uint32_t, uint32_t) { return 0.5f; }))[0], 0.0f);
  EXPECT_EQ(local_variance(synthetic::samples({1, 1}, [](uint32_t, uint32_t) { return 0.5f; }))[0], 0.0f);
}

} // namespace
} // namespace packtrace
