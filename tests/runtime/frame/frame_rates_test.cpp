#include <set>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "runtime/frame/still.h"
#include "runtime/trace/source/float_source.h"
#include "tests/runtime/trace/test_scenes.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

/// A floor with balls before an open background.
class RateBench {
public:
  RateBench() {
    test::add_shape(scene_, test::quad(Vec3(-4, 0, -4), Vec3(0, 0, 8), Vec3(8, 0, 0)));
    for (int i = 0; i < 5; ++i)
      test::add_shape(scene_, test::sphere(Vec3(-3.0f + 1.5f * float(i), 0.6f, float(i % 2)), 0.6f, 16));
    source_ = std::make_unique<FloatSource>(scene_);
    config_.size = {96, 60};
    config_.ao.radius = 1.5f;
  }
  static Camera camera(double x = 0.0) { return test::camera_at(DVec3(x, 2, -6), DVec3(0, 0.5, 0), 50.0); }
  RenderedImage still(const FrameConfig& config, uint32_t frames, PictureReport* report = nullptr) const {
    FrameLoop loop({source_.get(), nullptr, {}}, config);
    RenderedImage image;
    Progress progress;
    const PictureReport made = render_still(loop, camera(), 0.0, frames, false, image, progress);
    if (report != nullptr) *report = made;
    return image;
  }

  Scene scene_;
  std::unique_ptr<FloatSource> source_;
  FrameConfig config_;
};

double rms_difference(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0.0, count = 0.0;
  for (size_t i = 0; i < a.size(); ++i)
    if (a[i] >= 0.0f && b[i] >= 0.0f) sum += (a[i] - b[i]) * (a[i] - b[i]), count += 1.0;
  return std::sqrt(sum / count);
}

size_t invalid_pixels(const RenderedImage& image) {
  size_t invalid = 0;
  for (size_t i = 0; i < image.ao.size(); ++i) invalid += image.coverage[i] > 0.0f && !(image.ao[i] >= 0.0f) ? 1 : 0;
  return invalid;
}

TEST(FrameRates, CheckerboardsLeaveNoPixelWithoutAValue) {
  const RateBench bench;
  for (const bool jitter : {false, true})
    for (const bool denoise : {false, true}) {
      FrameConfig config = bench.config_;
      config.ao_rate = AoRate::kCheckerboard, config.denoise = denoise, config.jitter = jitter;
      for (const uint32_t frames : {1u, 2u, 3u, 8u})
        EXPECT_EQ(invalid_pixels(bench.still(config, frames)), 0u) << frames;
    }
}

TEST(FrameRates, CheckerboardsTraceHalfTheRays) {
  const RateBench bench;
  FrameConfig config = bench.config_;
  config.jitter = false;
  PictureReport full, half;
  bench.still(config, 4, &full);
  config.ao_rate = AoRate::kCheckerboard;
  for (const bool denoise : {false, true}) {
    config.denoise = denoise;
    bench.still(config, 4, &half);
    EXPECT_EQ(2 * half.ao_rays, full.ao_rays);
  }
}

TEST(FrameRates, CheckerboardsTraceBothColoursOfEachOffsetOfTheCameraRays) {
  const RateBench bench;
  FrameConfig config = bench.config_;
  config.ao_rate = AoRate::kCheckerboard;
  FrameLoop loop({bench.source_.get(), nullptr, {}}, config);
  Progress progress;
  for (int round = 0; round < 2; ++round) { // the view comes to rest at frame 1 and at frame 10
    loop.next_frame(RateBench::camera(0.1), 0.0, progress);
    std::set<uint64_t> hit_counts;
    for (int pair = 0; pair < 4; ++pair) {
      const uint64_t rays = loop.next_frame(RateBench::camera(), 0.0, progress).ao_rays;
      const FrameReport& second = loop.next_frame(RateBench::camera(), 0.0, progress);
      EXPECT_EQ(rays + second.ao_rays, second.hit_pixels) << pair;
      hit_counts.insert(second.hit_pixels);
    }
    EXPECT_GT(hit_counts.size(), 1u) << "the offsets show the same pixels";
  }
}

TEST(RawMean, PixelsWithoutSamplesGetTheMeanOfTheNearestOnes) {
  constexpr float kNone = kInvalidAo;
  AoFrame frame;
  frame.resize({5, 3});
  frame.ao = {0.2f,  kNone, 0.6f,  kNone, kNone, //
              kNone, kNone, 0.4f,  kNone, kNone, //
              kNone, kNone, kNone, kNone, kNone};
  std::vector<uint32_t> instances(15, 0);
  instances[13] = kNoInstance;
  RawMean mean;
  mean.add(frame);
  const std::vector<float> filled = mean.result(frame.size, instances);
  EXPECT_FLOAT_EQ(filled[0], 0.2f);
  EXPECT_FLOAT_EQ(filled[1], 0.4f);  // left and right
  EXPECT_FLOAT_EQ(filled[3], 0.6f);  // left, not the diagonal
  EXPECT_FLOAT_EQ(filled[11], 0.4f); // a diagonal, as none else has a value
  EXPECT_FLOAT_EQ(filled[9], 0.4f);  // two pixels away, in its row
  EXPECT_EQ(filled[13], kInvalidAo);
}

TEST(FrameRates, CheckerboardsConvergeToTheSameMean) {
  const RateBench bench;
  FrameConfig config = bench.config_;
  config.jitter = false, config.denoise = false;
  const RenderedImage full = bench.still(config, 64);
  config.ao_rate = AoRate::kCheckerboard;
  EXPECT_EQ(bench.still(config, 128).ao, full.ao); // the same samples
}

/// Independent noise falls with the square root of the number of samples, so half of them err 1.41 times as much.
/// Stratified samples err almost in inverse proportion to their number, so half of them err nearly twice as much.
TEST(FrameRates, ReducedRatesErrAsTheirNumberOfSamplesImplies) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  const RateBench bench;
  FrameConfig config = bench.config_;
  config.jitter = false;
  FrameConfig reference = config;
  reference.denoise = false, reference.ao.spp = 64, reference.ao.seed = 9;
  const RenderedImage truth = bench.still(reference, 16);
  for (const auto& [sampler, limit] : {std::pair{SamplerKind::kIndependent, 1.5}, {SamplerKind::kSpaceTimeNet, 2.0}})
    for (const uint32_t frames : {2u, 8u, 32u}) {
      config.ao.sampler = sampler;
      const double full = rms_difference(bench.still(config, frames).ao, truth.ao);
      FrameConfig reduced = config;
      reduced.ao_rate = AoRate::kCheckerboard;
      const double checkerboard = rms_difference(bench.still(reduced, frames).ao, truth.ao);
      EXPECT_LE(checkerboard, limit * full) << frames;
      reduced.ao_rate = AoRate::kAdaptive;
      const double adaptive = rms_difference(bench.still(reduced, frames).ao, truth.ao);
      EXPECT_LE(adaptive, 1.2 * full) << frames;
    }
}

std::vector<RenderedImage> reduced_pictures(FrameLoop& loop, int first, int last) {
  std::vector<RenderedImage> pictures;
  Progress progress;
  for (int i = first; i < last; ++i) {
    RenderedImage image;
    render_picture(loop, RateBench::camera(i < 3 ? 0.1 * i : 0.3), 0.0, 3, image, progress);
    pictures.push_back(image);
  }
  return pictures;
}

TEST(FrameRates, ContinueFromASavedStateOnAnyNumberOfThreads) {
  const RateBench bench;
  for (const AoRate rate : {AoRate::kCheckerboard, AoRate::kAdaptive})
    for (const bool denoise : {true, false}) {
      FrameConfig config = bench.config_;
      config.ao_rate = rate, config.denoise = denoise;
      FrameLoop whole({bench.source_.get(), nullptr, {}}, config);
      const std::vector<RenderedImage> expected = reduced_pictures(whole, 0, 6);
      for (const int stop : {2, 4}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(stop - 1));
        FrameLoop before({bench.source_.get(), nullptr, {}}, config), after({bench.source_.get(), nullptr, {}}, config);
        reduced_pictures(before, 0, stop);
        after.restore(bench.camera(stop - 1 < 3 ? 0.1 * (stop - 1) : 0.3), 0.0, before.save());
        const std::vector<RenderedImage> rest = reduced_pictures(after, stop, 6);
        for (size_t i = 0; i < rest.size(); ++i) {
          EXPECT_EQ(rest[i].ao, expected[i + static_cast<size_t>(stop)].ao);
          EXPECT_EQ(rest[i].ao_raw, expected[i + static_cast<size_t>(stop)].ao_raw);
        }
      }
    }
}

TEST(FrameRates, AdaptiveRatesKeepTheBudgetInMotion) {
  const RateBench bench;
  FrameConfig config = bench.config_;
  config.ao_rate = AoRate::kAdaptive;
  FrameLoop loop({bench.source_.get(), nullptr, {}}, config);
  Progress progress;
  for (int frame = 0; frame < 12; ++frame) {
    const FrameReport& report = loop.next_frame(RateBench::camera(0.1 * frame), 0.0, progress);
    EXPECT_LE(static_cast<double>(report.ao_rays), 1.05 * static_cast<double>(report.hit_pixels)) << frame;
    EXPECT_GE(static_cast<double>(report.ao_rays), 0.5 * static_cast<double>(report.hit_pixels)) << frame;
  }
}

} // namespace
} // namespace packtrace
