// Invariants of the denoiser on sequences of whole scenes that FrameLoop renders: still views, an orbit, a box that
// passes and leaves, camera cuts, and reduced rates. Limits are the same for all scenes unless a scene has its own.

#include <bit>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <ostream>
#include <string>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/regression/denoised_scene.h"
#include "tests/sanitized.h"

namespace packtrace::test {

/// What a scene must reach.
struct SceneLimits {
  const char* name; ///< folder and file below assets or, if shared, PACKTRACE_SCENES
  bool shared;
  double orbit_psnr;    ///< dB after 24 frames of half a degree
  double orbit_flicker; ///< mean change from frame to frame along the motion
};

static void PrintTo(const SceneLimits& limits, std::ostream* out) { *out << limits.name; }

namespace {

namespace fs = std::filesystem;

constexpr ImageSize kSize{96, 54};
constexpr uint32_t kTruthSpp = 128; ///< of moving views, whose errors are large
const uint32_t kStillTruthSpp = sanitized() ? 64 : 1024;
constexpr double kNotWorse = 0.98; ///< share of the reference's PSNR that is as good
constexpr double kStep = 0.5;      ///< degrees per frame of orbits

class DenoisedScenes : public testing::TestWithParam<SceneLimits> {
protected:
  void SetUp() override {
    const char* const shared = std::getenv("PACKTRACE_SCENES");
    if (GetParam().shared && shared == nullptr) GTEST_SKIP() << "PACKTRACE_SCENES is not set";
    if (sanitized() && std::string(GetParam().name) != "room/room.pbrt") GTEST_SKIP() << "the room is enough";
    const fs::path file =
        (GetParam().shared ? fs::path(shared) : fs::path(PACKTRACE_SOURCE_DIR) / "assets") / GetParam().name;
    if (GetParam().shared && !fs::exists(file)) GTEST_SKIP() << file << " is not there";
    auto& kept = scenes()[GetParam().name];
    if (!kept) kept = std::make_unique<SharedScene>(file);
    scene_ = &kept->scene, still_truth_ = &kept->still_truth;
  }
  /// What all tests of a scene share; they run in one process.
  struct SharedScene {
    explicit SharedScene(const fs::path& file) : scene(file, kSize) {}
    DenoisedScene scene;
    std::vector<float> still_truth = scene.truth(scene.orbit(0.0), DenoisedScene::kNoBox, kStillTruthSpp);
  };
  static std::map<std::string, std::unique_ptr<SharedScene>>& scenes() {
    static std::map<std::string, std::unique_ptr<SharedScene>> all;
    return all;
  }
  FrameConfig reference() const {
    FrameConfig config = scene_->config();
    config.denoiser.kind = DenoiserKind::kReference;
    return config;
  }
  FrameConfig unfiltered() const {
    FrameConfig config = scene_->config();
    config.denoiser.ours.passes = 0;
    return config;
  }

  const DenoisedScene* scene_ = nullptr;
  const std::vector<float>* still_truth_ = nullptr; ///< of orbit(0), without the box
};

/// The pictures of the frames [first, last) of an orbit.
std::vector<RenderedImage> orbit(const DenoisedScene& scene, FrameLoop& loop, uint32_t first, uint32_t last) {
  std::vector<RenderedImage> pictures;
  for (uint32_t f = first; f < last; ++f) pictures.push_back(next_picture(loop, scene.orbit(kStep * f)));
  return pictures;
}

TEST_P(DenoisedScenes, StillViewsConvergeBetterThanTheMeanOfTheirSamples) {
  if (sanitized()) GTEST_SKIP() << kOthersRunItsCode;
  FrameConfig mean = scene_->config();
  mean.denoise = false, mean.view_layers = false;
  FrameLoop ours = scene_->loop(scene_->config()), plain = scene_->loop(mean), other = scene_->loop(reference());
  const std::vector<float>& truth = *still_truth_;
  std::vector<double> sum(kSize.pixels()), squares(kSize.pixels());
  for (uint32_t f = 1; f <= 96; ++f) {
    const RenderedImage image = next_picture(ours, scene_->orbit(0.0));
    const RenderedImage samples = next_picture(plain, scene_->orbit(0.0));
    const RenderedImage rival = next_picture(other, scene_->orbit(0.0));
    ASSERT_EQ(invalid_pixels(image), 0u) << f;
    double history = 0.0, surfaces = 0.0;
    for (size_t i = 0; i < truth.size(); ++i) {
      if (truth[i] >= 0.0f) history += double{image.history[i]}, surfaces += 1.0;
      if (f > 64) sum[i] += double{image.ao[i]}, squares[i] += double{image.ao[i]} * double{image.ao[i]};
    }
    EXPECT_GE(history, 0.95 * f * surfaces) << "false resets, frame " << f;
    if (!std::has_single_bit(f)) continue;
    const Quality denoised = scene_->compare(image.ao, truth), raw = scene_->compare(samples.ao, truth);
    const Quality rivals = scene_->compare(rival.ao, truth);
    RecordProperty("psnr_" + std::to_string(f), std::to_string(denoised.psnr));
    EXPECT_GT(denoised.psnr, raw.psnr) << f;
    EXPECT_GT(denoised.ssim, raw.ssim) << f;
    EXPECT_GE(denoised.psnr, kNotWorse * rivals.psnr) << f;
    if (f != 64) continue;
    EXPECT_GE(denoised.psnr, 34.0);
    EXPECT_GE(denoised.ssim, 0.95);
    EXPECT_LE(denoised.flip, 0.05);
  }
  double sigma = 0.0, count = 0.0;
  for (size_t i = 0; i < truth.size(); ++i)
    if (truth[i] >= 0.0f) sigma += std::sqrt(std::max(0.0, squares[i] / 32 - sum[i] / 32 * sum[i] / 32)), count += 1.0;
  EXPECT_LE(sigma / count, 0.01) << "flicker";
}

/// Mean change along the motion, over surfaces that both pictures show.
double flicker(const RenderedImage& before, const RenderedImage& image) {
  double sum = 0.0, count = 0.0;
  for (uint32_t y = 0; y < kSize.height; ++y)
    for (uint32_t x = 0; x < kSize.width; ++x) {
      const size_t i = size_t{y} * kSize.width + x;
      const auto from_x = static_cast<int>(std::lround(static_cast<float>(x) - image.motion[i].x));
      const auto from_y = static_cast<int>(std::lround(static_cast<float>(y) - image.motion[i].y));
      if (image.coverage[i] == 0.0f || from_x < 0 || from_y < 0 || from_x >= int(kSize.width) ||
          from_y >= int(kSize.height))
        continue;
      const size_t j = size_t(from_y) * kSize.width + size_t(from_x);
      if (before.instance[j] != image.instance[i] || image.disocclusion[i] != 0.0f) continue;
      sum += std::abs(double{image.ao[i]} - double{before.ao[j]}), count += 1.0;
    }
  return sum / std::max(count, 1.0);
}

TEST_P(DenoisedScenes, OrbitsAreBetterThanTheirHistoryAndReference) {
  constexpr uint32_t kFrames = 24;
  FrameLoop ours = scene_->loop(scene_->config()), history = scene_->loop(unfiltered()),
            other = scene_->loop(reference());
  const std::vector<RenderedImage> pictures = orbit(*scene_, ours, 0, kFrames);
  const auto cap = static_cast<float>(FluxConfig{}.max_tspp_moving);
  double flickers = 0.0;
  for (uint32_t f = 0; f < kFrames; ++f) {
    EXPECT_EQ(invalid_pixels(pictures[f]), 0u) << f;
    double known = 0.0, sum = 0.0;
    for (size_t i = 0; i < kSize.pixels(); ++i) {
      if (pictures[f].coverage[i] == 0.0f) continue;
      ASSERT_GE(pictures[f].history[i], 1.0f) << f;
      if (glm::length(pictures[f].motion[i]) > 0.1f) { // the pivot stands still; cubic interpolation exceeds the cap
        ASSERT_LE(pictures[f].history[i], std::min(static_cast<float>(f + 1), cap) + 1.0f) << f;
      }
      if (pictures[f].disocclusion[i] == 0.0f) sum += double{pictures[f].history[i]}, known += 1.0;
    }
    if (f >= 12) {
      EXPECT_GE(sum, 0.6 * double{cap} * known) << "false resets, frame " << f;
      flickers += flicker(pictures[f - 1], pictures[f]);
    }
  }
  const std::vector<float> truth =
      scene_->truth(scene_->orbit(kStep * (kFrames - 1)), DenoisedScene::kNoBox, kTruthSpp);
  const Quality denoised = scene_->compare(pictures.back().ao, truth);
  const Quality raw = scene_->compare(orbit(*scene_, history, 0, kFrames).back().ao, truth);
  const Quality rivals = scene_->compare(orbit(*scene_, other, 0, kFrames).back().ao, truth);
  std::printf("%s: orbit %.2f dB %.4f, history %.2f %.4f, reference %.2f %.4f, flicker %.4f\n", GetParam().name,
              denoised.psnr, denoised.flip, raw.psnr, raw.flip, rivals.psnr, rivals.flip, flickers / (kFrames - 12));
  EXPECT_GT(denoised.psnr, raw.psnr);
  EXPECT_GT(denoised.ssim, raw.ssim);
  EXPECT_GE(denoised.psnr, kNotWorse * rivals.psnr);
  EXPECT_LT(denoised.flip, rivals.flip);
  EXPECT_GE(denoised.psnr, GetParam().orbit_psnr);
  EXPECT_LE(flickers / (kFrames - 12), GetParam().orbit_flicker);
}

TEST_P(DenoisedScenes, OrbitsDoNotDependOnTheNumberOfThreads) {
  const auto run = [&](size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    FrameLoop loop = scene_->loop(scene_->config());
    return orbit(*scene_, loop, 0, 4).back().ao;
  };
  EXPECT_EQ(run(1), run(3));
}

TEST_P(DenoisedScenes, ABoxThatLeavesTakesItsOcclusionAlong) {
  if (sanitized()) GTEST_SKIP() << kOthersRunItsCode;
  constexpr uint32_t kGone = DenoisedScene::kGone;
  const std::map<uint32_t, double> limits{{4, 0.5}, {8, 0.25}, {16, 0.1}, {32, 0.03}};
  const Camera camera = scene_->orbit(0.0);
  const std::vector<float> before = scene_->truth(camera, kGone - 1, kTruthSpp);
  const std::vector<float>& after = *still_truth_;
  FrameLoop loop = scene_->loop(scene_->config()), fresh = scene_->loop(scene_->config());
  RenderedImage covered;
  for (uint32_t f = 0; f < kGone; ++f) covered = next_picture(loop, camera, f);
  std::vector<uint8_t> uncovered(kSize.pixels());
  for (uint32_t since = 1; since <= 32; ++since) {
    const RenderedImage image = next_picture(loop, camera, kGone - 1 + since), anew = next_picture(fresh, camera);
    EXPECT_EQ(invalid_pixels(image), 0u) << since;
    double left = 0.0, norm = 0.0;
    for (size_t i = 0; i < kSize.pixels(); ++i) {
      uncovered[i] = image.instance[i] != covered.instance[i] ? 1 : 0;
      if (uncovered[i] != 0 || before[i] < 0.0f || after[i] < 0.0f) continue;
      const double change = double{before[i]} - double{after[i]};
      // Against a history that never had the box: the noise of `after` is part of `change`.
      left += change * (double{image.ao[i]} - double{anew.ao[i]}), norm += change * change;
    }
    ASSERT_GT(norm, 0.1) << "the box changes nothing";
    if (const auto limit = limits.find(since); limit != limits.end()) {
      std::printf("%s: %u frames after the box left, %.1f %% of its occlusion\n", GetParam().name, since,
                  100.0 * left / norm);
      EXPECT_LE(left / norm, limit->second) << since;
    }
    if (since == 12) {
      EXPECT_LE(DenoisedScene::rmse(image.ao, after, uncovered), 1.5 * DenoisedScene::rmse(anew.ao, after, uncovered))
          << "surfaces that come into view";
    }
  }
}

TEST_P(DenoisedScenes, CutsShowNothingOfTheViewBefore) {
  FrameLoop cut = scene_->loop(scene_->config()), fresh = scene_->loop(scene_->config());
  orbit(*scene_, cut, 0, 4);
  cut.reset();
  const RenderedImage first = next_picture(fresh, scene_->elsewhere());
  const RenderedImage again = next_picture(cut, scene_->elsewhere());
  EXPECT_EQ(again.ao, first.ao);
  EXPECT_EQ(again.variance, first.variance);
  EXPECT_EQ(*std::ranges::max_element(again.history), 1.0f);

  FrameLoop jump = scene_->loop(scene_->config());
  orbit(*scene_, jump, 0, 8);
  const RenderedImage after = next_picture(jump, scene_->elsewhere());
  EXPECT_EQ(invalid_pixels(after), 0u);
  const std::vector<float> truth = scene_->truth(scene_->elsewhere(), DenoisedScene::kNoBox, kTruthSpp);
  EXPECT_GE(scene_->compare(after.ao, truth).psnr, scene_->compare(first.ao, truth).psnr - 0.5)
      << "without reset, histories may only help";
}

TEST_P(DenoisedScenes, ReducedRatesErrAtMostHalfMore) {
  const std::vector<float>& truth = *still_truth_;
  const auto error = [&](const FrameConfig& config, uint32_t frames) {
    FrameLoop loop = scene_->loop(config);
    RenderedImage image;
    for (uint32_t f = 0; f < frames; ++f) {
      image = next_picture(loop, scene_->orbit(0.0));
      EXPECT_EQ(invalid_pixels(image), 0u) << f;
    }
    return scene_->compare(image.ao, truth).rmse;
  };
  FrameConfig quarter = scene_->config(), checkerboard = scene_->config(), adaptive = scene_->config();
  quarter.ao_resolution = AoResolution::kQuarter, quarter.ao.spp = 4; // as many rays
  checkerboard.ao_rate = AoRate::kCheckerboard, adaptive.ao_rate = AoRate::kAdaptive;
  EXPECT_LE(error(quarter, 1), 1.5 * error(scene_->config(), 1)) << "later, detail is missing";
  for (const uint32_t frames : {2u, 4u}) {
    const double full = error(scene_->config(), frames);
    EXPECT_LE(error(checkerboard, frames), 1.5 * full) << frames;
    EXPECT_LE(error(adaptive, frames), 1.05 * full) << frames << ": nothing is new after the first frame";
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, DenoisedScenes,
                         testing::Values(SceneLimits{"room/room.pbrt", false, 21.0, 0.03},
                                         SceneLimits{"town/town.pbrt", false, 16.0, 0.07},
                                         SceneLimits{"house/scene.pbrt", true, 19.3, 0.045}),
                         [](const auto& test) {
                           const std::string name = test.param.name;
                           return name.substr(0, name.find('/'));
                         });

} // namespace
} // namespace packtrace::test
