#include "runtime/denoise/denoiser.h"

#include <algorithm>
#include <map>

#include <gtest/gtest.h>

#include "tests/runtime/denoise/synthetic.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

using namespace synthetic;

constexpr ImageSize kSize{160, 128};

TEST(AoDenoiser, ConstantAoStaysConstantUnderAnyGuides) {
  const ImageSize size{61, 47};
  AoDenoiser denoiser;
  const AoFrame frame = samples(size, [](uint32_t, uint32_t) { return 0.37f; });
  for (uint32_t f = 0; f < 256; ++f) {
    GBuffer g = wall(size);
    const uint32_t guides = f < 128 ? f : 128; // new guides and motion in each of 128 frames, then still
    for (uint32_t i = 0; i < size.pixels(); ++i) {
      g.view_z[i] = uniform(i, 1, guides) < 0.1f ? 0.0f : 1.0f + 9.0f * uniform(i, 2, guides);
      if (uniform(i, 3, guides) < 0.5f)
        g.normal[i] = glm::normalize(Vec3(uniform(i, 4, guides), uniform(i, 5, guides), -1.0f));
      g.instance[i] = i % 3;
      if (f < 128) g.motion_px[i] = Vec2(uniform(i, 6, f) * 6.0f - 3.0f, uniform(i, 7, f) * 6.0f - 3.0f);
    }
    const DenoisedAo& result = denoiser.next_frame(g, frame);
    for (size_t i = 0; i < size.pixels(); ++i) {
      if (g.view_z[i] == 0.0f) {
        ASSERT_EQ(result.ao[i], kInvalidAo);
        continue;
      }
      ASSERT_NEAR(result.ao[i], 0.37f, 1.0f / 2048.0f) << "pixel " << i << " frame " << f;
    }
  }
}

TEST(AoDenoiser, FlatNoiseConvergesAtLeastAsFastAsRequiredAndBetterThanAccumulation) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  const std::map<uint32_t, double> limits = {{1, 0.045}, {8, 0.025}, {32, 0.015}, {64, 0.011}};
  for (float p : {0.1f, 0.3f, 0.5f, 0.9f}) {
    AoDenoiser denoiser;
    std::vector<float> sum(kSize.pixels(), 0.0f);
    for (uint32_t f = 1; f <= 64; ++f) {
      const AoFrame frame = noise(kSize, p, f);
      for (size_t i = 0; i < sum.size(); ++i) sum[i] += frame.ao[i];
      const DenoisedAo& result = denoiser.next_frame(wall(kSize), frame);
      const auto truth = [&](uint32_t, uint32_t) { return expected(p); };
      const double rmse = rmse_of(result.ao, kSize, all(kSize), truth);
      if (auto limit = limits.find(f); limit != limits.end()) {
        EXPECT_LE(rmse, limit->second) << "p " << p << " f " << f;
      }
      std::vector<float> plain = sum;
      for (float& v : plain) v /= static_cast<float>(f);
      EXPECT_LT(rmse, rmse_of(plain, kSize, all(kSize), truth)) << "p " << p << " f " << f;
    }
  }
}

TEST(AoDenoiser, BlurAloneKeepsTheMeanOfAFrameHoweverSkewedTheNoise) {
  for (float p : {0.02f, 0.1f, 0.5f, 0.98f}) {
    const AoFrame frame = noise(kSize, p, 7);
    AoDenoiser denoiser;
    const double raw = mean_of(frame.ao, kSize, all(kSize));
    const double blurred = mean_of(denoiser.next_frame(wall(kSize), frame).ao, kSize, all(kSize));
    EXPECT_NEAR(blurred / raw, 1.0, 0.001) << p;
  }
}

TEST(AoDenoiser, BlocksOfAFlatHaveTheMeanOfTheNoise) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  for (float p : {0.1f, 0.5f, 0.9f}) {
    AoDenoiser denoiser;
    const DenoisedAo* result = nullptr;
    for (uint32_t f = 0; f < 64; ++f) result = &denoiser.next_frame(wall(kSize), noise(kSize, p, f));
    for (uint32_t y = 0; y + 32 <= kSize.height; y += 32)
      for (uint32_t x = 0; x + 32 <= kSize.width; x += 32)
        EXPECT_NEAR(mean_of(result->ao, kSize, {x, y, x + 32, y + 32}), expected(p), 0.01) << p;
    EXPECT_NEAR(mean_of(result->ao, kSize, all(kSize)) / expected(p), 1.0, 0.005) << p;
  }
}

TEST(AoDenoiser, StillNoiseResetsNoHistory) {
  AoDenoiser denoiser;
  const DenoisedAo* result = nullptr;
  for (uint32_t f = 0; f < 64; ++f) result = &denoiser.next_frame(wall(kSize), noise(kSize, 0.5f, f));
  EXPECT_GE(mean_of(result->tspp, kSize, all(kSize)), 0.95 * 64);
  EXPECT_LE(*std::max_element(result->tspp.begin(), result->tspp.end()), 64.0f);
}

TEST(AoDenoiser, TsppCountsValidFramesUpToTheCap) {
  const ImageSize size{40, 24};
  DenoiserConfig config;
  config.ours.max_tspp = 10;
  config.ours.change_gamma = 10.0f; // disables the history correction in practice
  AoDenoiser denoiser(config);
  for (uint32_t f = 1; f <= 14; ++f) {
    const AoFrame frame = samples(size, [&](uint32_t x, uint32_t y) {
      return x < 20 || f % 2 == 0 ? noisy(0.5f, x, y, f) : kInvalidAo; // the right half samples every other frame
    });
    const DenoisedAo& result = denoiser.next_frame(wall(size), frame);
    for (uint32_t i = 0; i < size.pixels(); ++i)
      ASSERT_EQ(result.tspp[i], static_cast<float>(i % size.width < 20 ? std::min(f, 10u) : f / 2)) << "frame " << f;
  }
}

TEST(AoDenoiser, ConvergedImageDoesNotFlicker) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  AoDenoiser denoiser;
  std::vector<double> sum(kSize.pixels()), squares(kSize.pixels());
  for (uint32_t f = 0; f < 96; ++f) {
    const DenoisedAo& result = denoiser.next_frame(wall(kSize), noise(kSize, 0.5f, f));
    for (size_t i = 0; f >= 64 && i < sum.size(); ++i) {
      sum[i] += static_cast<double>(result.ao[i]);
      squares[i] += static_cast<double>(result.ao[i]) * static_cast<double>(result.ao[i]);
    }
  }
  double sigma = 0;
  for (size_t i = 0; i < sum.size(); ++i)
    sigma += std::sqrt(std::max(0.0, squares[i] / 32 - sum[i] / 32 * sum[i] / 32));
  EXPECT_LE(sigma / static_cast<double>(sum.size()), 0.01);
}

TEST(AoDenoiser, VarianceIsThatOfTheTemporalMean) {
  AoDenoiser denoiser;
  const float p = 0.3f, spread = 1.0f - kOccluded;
  for (uint32_t f = 1; f <= 32; ++f) {
    const DenoisedAo& result = denoiser.next_frame(wall(kSize), noise(kSize, p, f));
    const double truth = static_cast<double>(spread * spread * p * (1.0f - p)) / f;
    EXPECT_NEAR(mean_of(result.variance, kSize, all(kSize)) / truth, 1.0, 0.25) << f;
  }
}

/// Stripes of occlusion 4 pixels wide on one wall: noise and detail look alike, unless the number of samples is known.
float striped(uint32_t x) { return x / 4 % 2 != 0 ? 0.3f : 0.7f; }

AoFrame striped_means(uint32_t samples, uint32_t number) {
  AoFrame frame = synthetic::samples(kSize, [&](uint32_t x, uint32_t y) {
    float sum = 0.0f;
    for (uint32_t i = 0; i < samples; ++i) sum += noisy(striped(x), x, y, number * samples + i);
    return sum / static_cast<float>(samples);
  });
  frame.samples = samples;
  return frame;
}

/// RMSE after some frames of means of `samples`, a number that is passed to the denoiser.
double striped_error(uint32_t samples, uint32_t told, uint32_t frames) {
  AoDenoiser denoiser;
  const DenoisedAo* result = nullptr;
  for (uint32_t f = 0; f < frames; ++f) {
    AoFrame frame = striped_means(samples, f);
    frame.samples = told;
    result = &denoiser.next_frame(wall(kSize), frame);
  }
  return rmse_of(result->ao, kSize, all(kSize), [](uint32_t x, uint32_t) { return expected(striped(x)); });
}

TEST(AoDenoiser, PicturesOfManySamplesKeepTheirDetail) {
  EXPECT_LT(striped_error(16, 16, 1), 0.8 * striped_error(16, 1, 1));
  EXPECT_LT(striped_error(16, 16, 4), 0.8 * striped_error(16, 1, 4));
  EXPECT_LT(striped_error(64, 64, 1), 0.8 * striped_error(64, 1, 1));
  EXPECT_GT(striped_error(1, 64, 1), striped_error(1, 1, 1)) << "noise that is taken for detail";
}

TEST(AoDenoiser, FlatsOfManySamplesAreNoNoisierForTheirNumber) {
  for (const uint32_t frames : {1u, 8u}) {
    const auto error = [&](uint32_t told) {
      AoDenoiser denoiser;
      const DenoisedAo* result = nullptr;
      for (uint32_t f = 0; f < frames; ++f) {
        AoFrame frame = samples(kSize, [&](uint32_t x, uint32_t y) {
          float sum = 0.0f;
          for (uint32_t i = 0; i < 16; ++i) sum += noisy(0.5f, x, y, f * 16 + i);
          return sum / 16.0f;
        });
        frame.samples = told;
        result = &denoiser.next_frame(wall(kSize), frame);
      }
      return rmse_of(result->ao, kSize, all(kSize), [](uint32_t, uint32_t) { return expected(0.5f); });
    };
    EXPECT_LT(error(16), 1.6 * error(1)) << frames;
    EXPECT_LT(error(16), 0.3 * 0.375 / 4.0 / std::sqrt(static_cast<double>(frames))) << frames;
  }
}

TEST(AoDenoiser, LongStillHistoryIsThePlainMeanOfItsSamples) {
  const ImageSize size{48, 32};
  DenoiserConfig config;
  config.ours.passes = 0;
  config.ours.change_gamma = 10.0f;
  AoDenoiser denoiser(config);
  std::vector<double> sum(size.pixels());
  const DenoisedAo* result = nullptr;
  for (uint32_t f = 0; f < 64; ++f) {
    const AoFrame frame = noise(size, 0.4f, f);
    for (size_t i = 0; i < sum.size(); ++i) sum[i] += static_cast<double>(frame.ao[i]);
    result = &denoiser.next_frame(wall(size), frame);
  }
  for (size_t i = 0; i < sum.size(); ++i) ASSERT_NEAR(result->ao[i], sum[i] / 64, 1e-5);
}

} // namespace
} // namespace packtrace
