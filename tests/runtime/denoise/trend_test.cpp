#include "runtime/denoise/kernels/trend.h"

#include <cmath>

#include <gtest/gtest.h>

#include "runtime/denoise/denoiser.h"
#include "tests/runtime/denoise/synthetic.h"

namespace packtrace {
namespace {

using namespace synthetic;

TEST(Trend, PowersOfTwoAreCrossedOnceByWholeAndFractionalLengths) {
  for (const float start : {1.0f, 1.4f, 2.75f, 5.5f}) {
    int crossings = 0;
    for (float n = start; n < 100.0f; n += 1.0f) crossings += crosses_power_of_two(n) && n >= 8.0f ? 1 : 0;
    EXPECT_EQ(crossings, 4) << start; // 8, 16, 32, 64
  }
}

TEST(Trend, BitsKeepTheMeanAndTheDecay) {
  for (const float mean : {0.0f, 0.25f, 0.5001f, 1.0f}) {
    const Trend kept = unpack_trend(pack_trend({unpack_trend(next_trend(0, mean, 8.0f)).half, 0.3f}));
    EXPECT_NE(kept.half, 0u);
    EXPECT_NEAR(static_cast<float>(kept.half - 1) / Trend::kSteps, mean, 1e-5f);
    EXPECT_NEAR(kept.decay, 0.3f, 0.002f);
  }
}

TEST(Trend, NothingIsKnownBeforeTheSecondPowerOfTwo) {
  const uint32_t first = next_trend(0, 0.5f, 16.0f);
  EXPECT_EQ(unpack_trend(first).decay, 0.0f);
  EXPECT_GT(unpack_trend(next_trend(first, 0.6f, 32.0f)).decay, 0.0f);
}

/// Error beside a small step of occlusion, of samples that are stratified as well as one dimension allows: a van der
/// Corput sequence with another shift in each pixel.
double error_at_step(const DenoiserConfig& config) {
  const ImageSize size{96, 64};
  const auto occluded = [](uint32_t x) { return x < 48 ? 0.5f : 0.56f; };
  AoDenoiser denoiser(config);
  const DenoisedAo* result = nullptr;
  for (uint32_t f = 0; f < 64; ++f) {
    float inverse = 0.0f, digit = 0.5f;
    for (uint32_t bits = f; bits != 0; bits >>= 1, digit *= 0.5f) inverse += (bits & 1) != 0 ? digit : 0.0f;
    AoFrame frame = samples(size, [&](uint32_t x, uint32_t y) {
      const float u = inverse + uniform(x, y, 1000);
      return u - std::floor(u) < occluded(x) ? 0.0f : 1.0f;
    });
    frame.stratified = true;
    result = &denoiser.next_frame(wall(size), frame);
  }
  return rmse_of(result->ao, size, {40, 0, 56, 64}, [&](uint32_t x, uint32_t) { return 1.0f - occluded(x); });
}

TEST(AoDenoiser, BetterStratifiedSamplesAreFilteredLess) {
  DenoiserConfig fitted;
  fitted.ours.ratio_prior = 1e6f; // only the average of scenes
  EXPECT_LT(error_at_step({}), 0.8 * error_at_step(fitted));
}

TEST(AoDenoiser, WorseStratifiedSamplesAreFilteredMore) {
  DenoiserConfig fitted;
  fitted.ours.ratio_prior = 1e6f;
  const auto error = [](const DenoiserConfig& config) {
    const ImageSize size{96, 64};
    AoDenoiser denoiser(config);
    const DenoisedAo* result = nullptr;
    for (uint32_t f = 0; f < 64; ++f) {
      AoFrame frame = noise(size, 0.5f, f); // independent, whatever the frame says
      frame.stratified = true;
      result = &denoiser.next_frame(wall(size), frame);
    }
    return rmse_of(result->ao, size, all(size), [](uint32_t, uint32_t) { return expected(0.5f); });
  };
  EXPECT_LT(error({}), 0.8 * error(fitted));
}

} // namespace
} // namespace packtrace
