#include <cmath>
#include <limits>
#include <map>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "runtime/denoise/denoiser.h"
#include "tests/runtime/denoise/synthetic.h"

namespace packtrace {
namespace {

using namespace synthetic;

DenoiserConfig reference_config() {
  DenoiserConfig config;
  config.kind = DenoiserKind::kReference;
  return config;
}

TEST(ReferenceDenoiser, ConstantAoStaysConstantUnderAnyGuides) {
  const ImageSize size{61, 47};
  AoDenoiser denoiser(reference_config());
  const AoFrame frame = samples(size, [](uint32_t, uint32_t) { return 0.37f; });
  for (uint32_t f = 0; f < 64; ++f) {
    GBuffer g = wall(size);
    for (uint32_t i = 0; i < size.pixels(); ++i) {
      g.view_z[i] = uniform(i, 1, f) < 0.1f ? 0.0f : 1.0f + 9.0f * uniform(i, 2, f);
      g.motion_px[i] = Vec2(uniform(i, 6, f) * 6.0f - 3.0f, uniform(i, 7, f) * 6.0f - 3.0f);
    }
    const DenoisedAo& result = denoiser.next_frame(g, frame);
    for (size_t i = 0; i < size.pixels(); ++i)
      ASSERT_NEAR(result.ao[i], g.view_z[i] == 0.0f ? kInvalidAo : 0.37f, 1.0f / 2048.0f) << "frame " << f;
  }
}

TEST(ReferenceDenoiser, FlatNoiseConverges) {
  const ImageSize size{160, 128};
  const std::map<uint32_t, double> limits = {{1, 0.04}, {4, 0.04}, {8, 0.03}, {16, 0.025}, {32, 0.015}, {64, 0.011}};
  AoDenoiser denoiser(reference_config());
  for (uint32_t f = 1; f <= 64; ++f) {
    const DenoisedAo& result = denoiser.next_frame(wall(size), noise(size, 0.5f, f));
    if (const auto limit = limits.find(f); limit != limits.end()) {
      EXPECT_LE(rmse_of(result.ao, size, all(size), [](uint32_t, uint32_t) { return expected(0.5f); }), limit->second)
          << f;
    }
  }
}

std::vector<float> run_reference(size_t threads) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  AoDenoiser denoiser(reference_config());
  const ImageSize size{131, 117};
  std::vector<float> result;
  for (uint32_t f = 0; f < 6; ++f) {
    GBuffer g = wall(size);
    for (uint32_t i = 0; i < size.pixels(); ++i) {
      g.view_z[i] = uniform(i, 0, 0) < 0.02f ? 0.0f : 10.0f + std::sin(static_cast<float>(i) * 0.2f);
      g.motion_px[i] = Vec2(0.3f, -0.7f);
    }
    const DenoisedAo& frame = denoiser.next_frame(g, noise(size, 0.5f, f));
    result.insert(result.end(), frame.ao.begin(), frame.ao.end());
  }
  return result;
}

TEST(ReferenceDenoiser, ThreadsDoNotChangeABit) { EXPECT_EQ(run_reference(1), run_reference(7)); }

TEST(ReferenceDenoiser, CheckerboardsAndDamagedTexelsLeaveNothingInvalid) {
  const ImageSize size{67, 45};
  AoDenoiser denoiser(reference_config());
  for (uint32_t f = 0; f < 12; ++f) {
    GBuffer g = wall(size);
    AoFrame frame =
        samples(size, [&](uint32_t x, uint32_t y) { return (x + y + f) % 2 == 0 ? noisy(0.5f, x, y, f) : kInvalidAo; });
    const float nan = std::numeric_limits<float>::quiet_NaN();
    if (f == 5) frame.ao[1000] = nan, frame.hit_distance[1001] = nan, g.normal[900].x = nan, g.motion_px[800].y = nan;
    for (const float ao : denoiser.next_frame(g, frame).ao) ASSERT_TRUE(ao >= 0.0f && ao <= 1.0f) << "frame " << f;
  }
}

TEST(ReferenceDenoiser, ContinuesWhereItWasSaved) {
  const ImageSize size{67, 45};
  AoDenoiser denoiser(reference_config()), other(reference_config());
  for (uint32_t f = 0; f < 5; ++f) denoiser.next_frame(wall(size), noise(size, 0.5f, f));
  other.restore(size, denoiser.save());
  EXPECT_EQ(denoiser.next_frame(wall(size), noise(size, 0.5f, 5)).ao,
            other.next_frame(wall(size), noise(size, 0.5f, 5)).ao);
}

} // namespace
} // namespace packtrace
