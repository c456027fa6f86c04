// Invariants of every denoiser on synthetic images. Where the preset reference, which shows what other renderers do,
// fails one, its own limit stands beside the default denoiser's.

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <string>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "runtime/denoise/denoiser.h"
#include "tests/runtime/denoise/synthetic.h"

namespace packtrace {
namespace {

using namespace synthetic;

constexpr ImageSize kInvariantSize{128, 96};

class DenoiserInvariants : public testing::TestWithParam<DenoiserKind> {
protected:
  static bool ours() { return GetParam() == DenoiserKind::kOurs; }
  static double cap() { return ours() ? double{FluxConfig{}.max_tspp} : double{ReferenceConfig{}.max_tspp}; }
  static DenoiserConfig config() {
    DenoiserConfig config;
    config.kind = GetParam();
    return config;
  }
  AoDenoiser denoiser_{config()};
};

TEST_P(DenoiserInvariants, FlatsConvergeAndKeepTheirMean) {
  const std::map<uint32_t, double> limits = {{1, 0.045}, {8, 0.025}, {32, 0.015}, {64, 0.011}};
  for (const float p : {0.1f, 0.5f, 0.9f}) {
    AoDenoiser denoiser(config());
    const DenoisedAo* result = nullptr;
    for (uint32_t f = 1; f <= 64; ++f) {
      result = &denoiser.next_frame(wall(kInvariantSize), noise(kInvariantSize, p, f));
      if (const auto limit = limits.find(f); limit != limits.end()) {
        EXPECT_LE(
            rmse_of(result->ao, kInvariantSize, all(kInvariantSize), [&](uint32_t, uint32_t) { return expected(p); }),
            limit->second * (ours() ? 1.0 : 2.5)) // the clamp of reference takes skewed noise for changes
            << "p " << p << " frame " << f;
      }
    }
    for (uint32_t y = 0; y + 32 <= kInvariantSize.height; y += 32)
      for (uint32_t x = 0; x + 32 <= kInvariantSize.width; x += 32)
        EXPECT_NEAR(mean_of(result->ao, kInvariantSize, {x, y, x + 32, y + 32}), expected(p), ours() ? 0.01 : 0.03)
            << p;
    EXPECT_NEAR(mean_of(result->ao, kInvariantSize, all(kInvariantSize)) / expected(p), 1.0, ours() ? 0.005 : 0.07)
        << p;
    EXPECT_GE(mean_of(result->tspp, kInvariantSize, all(kInvariantSize)), 0.95 * std::min(64.0, cap()));
  }
}

TEST_P(DenoiserInvariants, SpareMemoryHoldsNothing) {
  AoDenoiser freed(config());
  GBuffer g = wall(kInvariantSize);
  for (uint32_t f = 0; f < 12; ++f) {
    const HistorySource source = f % 4 == 0   ? HistorySource::kMotion
                                 : f % 4 == 1 ? HistorySource::kUnchanged
                                              : HistorySource::kPixel;
    std::ranges::fill(g.motion_px, f % 4 == 0 ? Vec2(1.25f, -0.5f) : Vec2(0));
    const AoFrame frame = noise(kInvariantSize, 0.5f, f);
    denoiser_.add_frame(g, frame, source), freed.add_frame(g, frame, source);
    if (f % 8 == 0) {
      const size_t kept = freed.state_bytes();
      freed.free_spare_memory();
      EXPECT_EQ(freed.state_bytes() < kept, ours());
    }
    EXPECT_EQ(freed.denoise().ao, denoiser_.denoise().ao) << f;
    freed.free_spare_memory();
  }
}

TEST_P(DenoiserInvariants, ConvergedFlatsDoNotFlicker) {
  std::vector<double> sum(kInvariantSize.pixels()), squares(kInvariantSize.pixels());
  for (uint32_t f = 0; f < 96; ++f) {
    const DenoisedAo& result = denoiser_.next_frame(wall(kInvariantSize), noise(kInvariantSize, 0.5f, f));
    for (size_t i = 0; f >= 64 && i < sum.size(); ++i)
      sum[i] += double{result.ao[i]}, squares[i] += double{result.ao[i]} * double{result.ao[i]};
  }
  double sigma = 0.0;
  for (size_t i = 0; i < sum.size(); ++i)
    sigma += std::sqrt(std::max(0.0, squares[i] / 32 - sum[i] / 32 * sum[i] / 32));
  EXPECT_LE(sigma / static_cast<double>(sum.size()), 0.01);
}

TEST_P(DenoiserInvariants, EdgesOfDepthAndNormalDoNotLeak) {
  const auto leak = [](const std::function<void(GBuffer&, size_t i, bool right)>& change) {
    GBuffer g = wall(kInvariantSize);
    for (size_t i = 0; i < kInvariantSize.pixels(); ++i) change(g, i, i % kInvariantSize.width >= 64);
    AoDenoiser denoiser(config());
    double worst = 0.0;
    for (uint32_t f = 0; f < 8; ++f) {
      const AoFrame frame =
          samples(kInvariantSize, [&](uint32_t x, uint32_t y) { return x < 64 ? noisy(0.5f, x, y, f) : 1.0f; });
      worst = std::max(
          worst, 1.0 - mean_of(denoiser.next_frame(g, frame).ao, kInvariantSize, {64, 0, 68, kInvariantSize.height}));
    }
    return worst;
  };
  EXPECT_GT(leak([](GBuffer&, size_t, bool) {}), 0.01) << "without an edge noise spreads: the test can fail";
  for (const float step : {0.9f, 1.1f})
    EXPECT_LE(leak([&](GBuffer& g, size_t i, bool right) { g.view_z[i] *= right ? step : 1.0f; }), 0.01) << step;
  const double crease = leak([](GBuffer& g, size_t i, bool right) {
    const float c = std::sqrt(0.5f);
    g.view_z[i] = 10.0f - 0.01f * std::abs(static_cast<float>(i % kInvariantSize.width) - 63.5f);
    g.normal[i] = Vec3(right ? c : -c, 0, -c);
  });
  EXPECT_LE(crease, ours() ? 0.01 : 0.2) << "the last blur of reference compares depths only";
}

TEST_P(DenoiserInvariants, GhostsOfARemovedOccluderFade) {
  static constexpr Rect kChanged{30, 20, 90, 76};
  static constexpr uint32_t kBefore = 64;
  const auto p = [](uint32_t f, uint32_t x, uint32_t y) {
    return f < kBefore && x >= kChanged.x0 && x < kChanged.x1 && y >= kChanged.y0 && y < kChanged.y1 ? 0.9f : 0.1f;
  };
  std::map<uint32_t, double> left;
  for (uint32_t f = 0; f < kBefore + 32; ++f) {
    const AoFrame frame = samples(kInvariantSize, [&](uint32_t x, uint32_t y) { return noisy(p(f, x, y), x, y, f); });
    const DenoisedAo& result = denoiser_.next_frame(wall(kInvariantSize), frame);
    if (f >= kBefore)
      left[f + 1 - kBefore] = std::abs(mean_of(result.ao, kInvariantSize, kChanged) - double{expected(0.1f)}) /
                              double{expected(0.1f) - expected(0.9f)};
  }
  EXPECT_LE(left[4], 0.5);
  EXPECT_LE(left[8], 0.25);
  EXPECT_LE(left[16], 0.1);
  EXPECT_LE(left[32], ours() ? 0.03 : 0.1);
}

TEST_P(DenoiserInvariants, UncoveredSurfacesCatchUpInTwelveFrames) {
  const auto card = [](uint32_t f, uint32_t x, uint32_t y) { // moves right by 16 pixels in frame 24
    const uint32_t left = f < 24 ? 32 : 48;
    return x >= left && x < left + 40 && y >= 20 && y < 76;
  };
  double uncovered = 0.0, converged = 0.0;
  for (uint32_t run = 0; run < 4; ++run)
    for (uint32_t f = 0; f < 36; ++f) {
      if (f == 0) denoiser_.reset();
      GBuffer g = wall(kInvariantSize);
      for (uint32_t i = 0; i < kInvariantSize.pixels(); ++i)
        if (card(f, i % kInvariantSize.width, i / kInvariantSize.width)) {
          g.view_z[i] = 5.0f, g.instance[i] = 1;
          if (f == 24) g.motion_px[i] = Vec2(16, 0);
        }
      const DenoisedAo& result = denoiser_.next_frame(g, noise(kInvariantSize, 0.5f, 100 * run + f));
      for (const float ao : result.ao) ASSERT_TRUE(ao >= 0.0f && ao <= 1.0f) << "frame " << f;
      const auto truth = [](uint32_t, uint32_t) { return expected(0.5f); };
      if (f == 35) {
        uncovered += rmse_of(result.ao, kInvariantSize, {32, 20, 48, 76}, truth);
        converged += rmse_of(result.ao, kInvariantSize, {96, 0, 128, 96}, truth);
      }
    }
  EXPECT_LE(uncovered / converged, ours() ? 1.5 : 3.0);
}

TEST_P(DenoiserInvariants, IntegerPansLoseNothingAndSubPixelPansLittle) {
  const auto error = [](Vec2 pan) {
    DenoiserConfig equal = config();
    equal.ours.max_tspp = equal.ours.max_tspp_moving; // as long for still images
    AoDenoiser denoiser(equal);
    double rmse = 0.0;
    for (uint32_t f = 0; f < 32; ++f) {
      const auto p = [&](uint32_t x, uint32_t y) {
        const Vec2 at = Vec2(static_cast<float>(x), static_cast<float>(y)) - pan * static_cast<float>(f);
        return 0.5f + 0.3f * std::sin(at.x * 0.15f) * std::cos(at.y * 0.2f);
      };
      GBuffer g = wall(kInvariantSize);
      if (f > 0) std::ranges::fill(g.motion_px, pan);
      const DenoisedAo& result = denoiser.next_frame(
          g, samples(kInvariantSize, [&](uint32_t x, uint32_t y) { return noisy(p(x, y), x, y, f); }));
      rmse = rmse_of(result.ao, kInvariantSize, {40, 24, 120, 72},
                     [&](uint32_t x, uint32_t y) { return expected(p(x, y)); });
    }
    return -20.0 * std::log10(rmse);
  };
  const double still = error(Vec2(0)), lost = ours() ? 2.0 : 7.0; // reference blurs its history
  EXPECT_GE(error(Vec2(1, 0)), still - 1.0);                      // other noise in the window
  EXPECT_GE(error(Vec2(0.5f, -0.5f)), still - lost);
  EXPECT_GE(error(Vec2(-0.1f, 0.2f)), still - lost);
}

TEST_P(DenoiserInvariants, DamagedTexelsHealInTwoFrames) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  for (uint32_t f = 0; f < 8; ++f) {
    GBuffer g = wall(kInvariantSize);
    AoFrame frame = noise(kInvariantSize, 0.5f, f);
    if (f == 4)
      frame.ao[1000] = nan, frame.ao[2000] = infinity, frame.hit_distance[1001] = nan, g.normal[900].x = nan,
      g.motion_px[800].y = nan, g.view_z[700] = nan, g.view_z[600] = infinity;
    const DenoisedAo& result = denoiser_.next_frame(g, frame);
    for (size_t i = 0; i < kInvariantSize.pixels(); ++i) {
      const bool miss = f == 4 && (i == 700 || i == 600);
      ASSERT_TRUE(miss ? result.ao[i] == kInvalidAo : result.ao[i] >= 0.0f && result.ao[i] <= 1.0f) << i;
      ASSERT_TRUE(std::isfinite(result.variance[i]) && std::isfinite(result.tspp[i])) << i;
      ASSERT_TRUE(f != 6 || result.tspp[i] > 0.0f) << i;
    }
  }
}

TEST_P(DenoiserInvariants, CameraCutsAndNewSizesBeginAnew) {
  const AoFrame dark = samples(kInvariantSize, [](uint32_t, uint32_t) { return 0.2f; });
  for (uint32_t f = 0; f < 4; ++f) denoiser_.next_frame(wall(kInvariantSize), dark);
  GBuffer cut = wall(kInvariantSize, 30.0f); // another place: the histories' depths do not fit
  std::ranges::fill(cut.instance, 7u);
  const AoFrame bright = samples(kInvariantSize, [](uint32_t, uint32_t) { return 0.9f; });
  const DenoisedAo& after = denoiser_.next_frame(cut, bright);
  EXPECT_EQ(mean_of(after.tspp, kInvariantSize, all(kInvariantSize)), 1.0);
  EXPECT_NEAR(mean_of(after.ao, kInvariantSize, all(kInvariantSize)), 0.9, 1e-4);
  denoiser_.reset();
  EXPECT_NEAR(mean_of(denoiser_.next_frame(cut, dark).ao, kInvariantSize, all(kInvariantSize)), 0.2, 1e-4);
  const ImageSize small{40, 30};
  const DenoisedAo& resized =
      denoiser_.next_frame(wall(small), samples(small, [](uint32_t, uint32_t) { return 0.5f; }));
  EXPECT_EQ(mean_of(resized.tspp, small, all(small)), 1.0);
}

TEST_P(DenoiserInvariants, CheckerboardsLeaveNothingInvalidAndStayClose) {
  AoDenoiser full(config());
  double board = 0.0, every = 0.0;
  const auto truth = [](uint32_t, uint32_t) { return expected(0.5f); };
  for (uint32_t f = 0; f < 16; ++f) {
    const AoFrame frame = samples(kInvariantSize, [&](uint32_t x, uint32_t y) {
      return (x + y + f) % 2 == 0 ? noisy(0.5f, x, y, f) : kInvalidAo;
    });
    const DenoisedAo& result = denoiser_.next_frame(wall(kInvariantSize), frame);
    for (const float ao : result.ao) ASSERT_TRUE(f < 2 || (ao >= 0.0f && ao <= 1.0f)) << "frame " << f;
    board = rmse_of(result.ao, kInvariantSize, all(kInvariantSize), truth);
    every = rmse_of(full.next_frame(wall(kInvariantSize), noise(kInvariantSize, 0.5f, f)).ao, kInvariantSize,
                    all(kInvariantSize), truth);
  }
  EXPECT_LE(board, 1.5 * every);
}

TEST_P(DenoiserInvariants, ThreadsDoNotChangeABit) {
  const auto run = [](size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    AoDenoiser denoiser(config());
    std::vector<float> all_frames;
    for (uint32_t f = 0; f < 9; ++f) { // moves, then stands still
      GBuffer g = wall(kInvariantSize);
      for (uint32_t i = 0; i < kInvariantSize.pixels(); ++i) {
        g.view_z[i] = uniform(i, 0, 0) < 0.02f ? 0.0f : 10.0f + std::sin(static_cast<float>(i) * 0.2f);
        if (f < 4) g.motion_px[i] = Vec2(0.3f, -0.7f);
      }
      AoFrame frame = noise(kInvariantSize, 0.5f, f);
      frame.stratified = true;
      const DenoisedAo& result = denoiser.next_frame(g, frame);
      all_frames.insert(all_frames.end(), result.ao.begin(), result.ao.end());
    }
    return all_frames;
  };
  EXPECT_EQ(run(1), run(5));
}

INSTANTIATE_TEST_SUITE_P(Presets, DenoiserInvariants, testing::Values(DenoiserKind::kOurs, DenoiserKind::kReference),
                         [](const auto& test) { return test.param == DenoiserKind::kOurs ? "ours" : "reference"; });

} // namespace
} // namespace packtrace
