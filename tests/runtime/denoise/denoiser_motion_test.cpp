#include "runtime/denoise/denoiser.h"

#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "runtime/denoise/reprojection.h"
#include "tests/runtime/denoise/synthetic.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

using namespace synthetic;

constexpr ImageSize kMotionSize{160, 96};
const uint32_t kMovingFrames = FluxConfig{}.max_tspp_moving + 1; ///< longest history of moving pixels, with this frame

TEST(Reprojection, IntegerPansFetchTheSameBits) {
  const ImageSize size{33, 21};
  FrameHistory previous;
  previous.guides.resize(size), previous.history.resize(size);
  GBuffer g = wall(size);
  previous.guides.load(g);
  for (int y = 0; y < 21; ++y)
    for (int x = 0; x < 33; ++x) {
      const auto random = [&](uint32_t c) { return uniform(static_cast<uint32_t>(x), static_cast<uint32_t>(y), c); };
      const auto moment = [&](uint32_t c) { return static_cast<uint16_t>(random(c) * kMomentUnits); };
      previous.history.mean.row(y)[x] = random(0), previous.history.square.row(y)[x] = moment(1);
      previous.history.fast.row(y)[x] = moment(2), previous.history.samples.row(y)[x] = 7.0f;
    }
  for (Vec2& motion : g.motion_px) motion = Vec2(3, -2);
  const FluxConfig config;
  ReprojectionRows rows(size, config, history_kernels(chosen_isa()));
  for (int y = 0; y < 21; ++y) { // the rows are the same memory, so a rejection must overwrite an earlier row's values
    const PastRow out = rows.at({previous, previous.guides, g.motion_px, {}}, y);
    for (int x = 0; x < 33; ++x) {
      const bool seen = x >= 3 && y + 2 < 21;
      ASSERT_EQ(out.samples[x], seen ? 7.0f : 0.0f);
      ASSERT_EQ(out.mean[x], seen ? previous.history.mean.row(y + 2)[x - 3] : 0.0f);
      // These moments are multiples of their storage unit, so storing them changes nothing.
      ASSERT_EQ(std::lround(out.square[x] * kMomentUnits), seen ? previous.history.square.row(y + 2)[x - 3] : 0);
      ASSERT_EQ(std::lround(out.fast[x] * kMomentUnits), seen ? previous.history.fast.row(y + 2)[x - 3] : 0);
    }
  }
}

/// Denoises two frames with a change of the guides in between. Returns whether the pixels keep their history.
bool keeps_history(const std::function<void(GBuffer&, size_t)>& change) {
  AoDenoiser denoiser;
  GBuffer g = wall(kMotionSize);
  denoiser.next_frame(g, noise(kMotionSize, 0.5f, 0));
  for (size_t i = 0; i < kMotionSize.pixels(); ++i) change(g, i);
  return denoiser.next_frame(g, noise(kMotionSize, 0.5f, 1)).tspp[kMotionSize.pixels() / 2 + 80] > 1.5f;
}

TEST(Reprojection, AnotherDepthNormalOrInstanceIsAnotherSurface) {
  EXPECT_TRUE(keeps_history([](GBuffer&, size_t) {}));
  EXPECT_TRUE(keeps_history([](GBuffer& g, size_t i) { g.view_z[i] *= 1.01f; })); // the camera moves away slightly
  EXPECT_FALSE(keeps_history([](GBuffer& g, size_t i) { g.view_z[i] *= 1.1f; }));
  EXPECT_FALSE(keeps_history([](GBuffer& g, size_t i) { g.normal[i] = Vec3(0.8f, 0, -0.6f); }));
  EXPECT_FALSE(keeps_history([](GBuffer& g, size_t i) { g.instance[i] = 1; }));
  EXPECT_FALSE(keeps_history([](GBuffer& g, size_t i) { g.motion_px[i] = Vec2(1e30f, 0); }));
}

TEST(Reprojection, ComparesDepthWhereTheSurfaceWas) {
  const auto from = [](float z_before) {
    return [=](GBuffer& g, size_t i) {
      g.previous_z.resize(kMotionSize.pixels());
      g.view_z[i] *= 1.1f, g.previous_z[i] = z_before;
    };
  };
  EXPECT_TRUE(keeps_history(from(10.0f))); // the wall was at 10 and moved away by 10 %
  EXPECT_FALSE(keeps_history(from(11.0f)));
  EXPECT_FALSE(keeps_history(from(9.0f)));
  EXPECT_FALSE(keeps_history(from(0.0f))); // behind the previous camera
  EXPECT_FALSE(keeps_history(from(-10.0f)));
  EXPECT_FALSE(keeps_history(from(std::nanf(""))));
}

TEST(AoDenoiser, SurfacesThatComeNearerKeepTheirHistory) {
  AoDenoiser denoiser;
  float z = 50.0f;
  for (uint32_t f = 0; f < 20; ++f) {
    GBuffer g = wall(kMotionSize, z); // the centre of the image grows by 10 % a frame: motion away from it
    g.previous_z.assign(kMotionSize.pixels(), f == 0 ? z : z / 0.9f);
    for (uint32_t y = 0; y < kMotionSize.height; ++y)
      for (uint32_t x = 0; x < kMotionSize.width; ++x)
        g.motion_px[y * kMotionSize.width + x] =
            0.1f * Vec2(static_cast<float>(x) + 0.5f - 80.0f, static_cast<float>(y) + 0.5f - 48.0f);
    const DenoisedAo& result = denoiser.next_frame(g, noise(kMotionSize, 0.5f, f));
    EXPECT_GT(mean_of(result.tspp, kMotionSize, {20, 20, 140, 76}), 0.9 * std::min(f + 1, kMovingFrames));
    z *= 0.9f;
  }
}

TEST(AoDenoiser, MovingInstancesKeepHistoryAndWhatTheyUncoverHasNone) {
  DenoiserConfig config;
  config.ours.reprojection_nearby = 0.0f;
  AoDenoiser denoiser(config), nearby;
  for (uint32_t f = 0; f < 24; ++f) { // a card that moves right by 3 pixels and nearer by 5 % a frame
    GBuffer g = wall(kMotionSize);
    g.previous_z = g.view_z;
    const auto z_at = [](uint32_t frame) { return 8.0f * std::pow(0.95f, static_cast<float>(frame)); };
    for (uint32_t i = 0; i < kMotionSize.pixels(); ++i) {
      const uint32_t x = i % kMotionSize.width, y = i / kMotionSize.width, left = 20 + 3 * f;
      if (x < left || x >= left + 30 || y < 20 || y >= 76) continue;
      g.view_z[i] = z_at(f), g.previous_z[i] = f == 0 ? z_at(f) : z_at(f - 1);
      g.instance[i] = 1;
      if (f > 0) g.motion_px[i] = Vec2(3, 0);
    }
    const DenoisedAo& result = denoiser.next_frame(g, noise(kMotionSize, 0.5f, f));
    const DenoisedAo& begun = nearby.next_frame(g, noise(kMotionSize, 0.5f, f));
    if (f == 0) continue;
    const uint32_t left = 20 + 3 * f;
    const float length = static_cast<float>(f + 1), moving = static_cast<float>(std::min(f + 1, kMovingFrames));
    EXPECT_GT(mean_of(result.tspp, kMotionSize, {left + 3, 24, left + 27, 72}), 0.8f * moving)
        << "on the card, frame " << f;
    EXPECT_EQ(mean_of(result.tspp, kMotionSize, {left - 3, 20, left, 76}), 1.0) << "uncovered, frame " << f;
    const double next_to_wall = mean_of(begun.tspp, kMotionSize, {left - 3, 24, left - 2, 72});
    EXPECT_GT(next_to_wall, 1.3) << "frame " << f;
    EXPECT_LE(next_to_wall, 1.0 + 0.36 * config.ours.max_tspp_moving) << "frame " << f;
    EXPECT_EQ(mean_of(begun.tspp, kMotionSize, {left - 1, 24, left, 72}), 1.0) << "too far from the wall, frame " << f;
    EXPECT_GT(mean_of(result.tspp, kMotionSize, {0, 80, kMotionSize.width, 96}), 0.8f * length) << "still, frame " << f;
  }
}

/// RMSE on edges thinner than a pixel: of every sixth row, every other pixel shows them, in turn from frame to frame.
double rmse_of_thin_edges(float nearby) {
  DenoiserConfig config;
  config.ours.reprojection_nearby = nearby;
  AoDenoiser denoiser(config);
  const ImageSize size{96, 60};
  double sum = 0, count = 0;
  for (uint32_t f = 0; f < 24; ++f) {
    GBuffer g = wall(size);
    for (uint32_t y = 3; y < size.height; y += 6)
      for (uint32_t x = f % 2; x < size.width; x += 2)
        g.view_z[y * size.width + x] = 8.0f, g.instance[y * size.width + x] = 1;
    const DenoisedAo& result =
        denoiser.next_frame(g, samples(size, [&](uint32_t x, uint32_t y) {
                              return noisy(g.instance[y * size.width + x] == 1 ? 0.6f : 0.2f, x, y, f);
                            }));
    for (uint32_t i = 0; i < size.pixels() && f >= 8; ++i)
      if (g.instance[i] == 1) sum += std::pow(double{result.ao[i]} - double{expected(0.6f)}, 2.0), count += 1;
  }
  return std::sqrt(sum / count);
}

TEST(AoDenoiser, EdgesThinnerThanAPixelStartFromTheHistoryAround) {
  const double without = rmse_of_thin_edges(0.0f), with = rmse_of_thin_edges(FluxConfig{}.reprojection_nearby);
  EXPECT_LT(with, 0.8 * without) << "without: " << without;
}

/// PSNR after 64 frames of a wall with smooth occlusion that moves by `pan` pixels per frame.
double psnr_of_pan(Vec2 pan) {
  DenoiserConfig config;
  config.ours.max_tspp = config.ours.max_tspp_moving; // equal history lengths for still and moving images
  AoDenoiser denoiser(config);
  const auto p_at = [](float x, float y) { return 0.5f + 0.3f * std::sin(x * 0.15f) * std::cos(y * 0.2f); };
  double rmse = 0;
  for (uint32_t f = 0; f < 64; ++f) {
    const Vec2 shift = pan * static_cast<float>(f);
    const auto p = [&](uint32_t x, uint32_t y) {
      return p_at(static_cast<float>(x) - shift.x, static_cast<float>(y) - shift.y);
    };
    GBuffer g = wall(kMotionSize);
    for (Vec2& motion : g.motion_px) motion = f == 0 ? Vec2(0) : pan;
    const DenoisedAo& result =
        denoiser.next_frame(g, samples(kMotionSize, [&](uint32_t x, uint32_t y) { return noisy(p(x, y), x, y, f); }));
    rmse =
        rmse_of(result.ao, kMotionSize, {40, 40, 120, 56}, [&](uint32_t x, uint32_t y) { return expected(p(x, y)); });
  }
  return -20.0 * std::log10(rmse);
}

TEST(Reprojection, SubPixelPansLoseLittle) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  const double still = psnr_of_pan(Vec2(0));
  EXPECT_GE(psnr_of_pan(Vec2(0.37f, 0.0f)), still - 2.0);
  EXPECT_GE(psnr_of_pan(Vec2(0.5f, -0.5f)), still - 2.0);
  EXPECT_GE(psnr_of_pan(Vec2(-0.1f, 0.2f)), still - 2.0);
}

TEST(AoDenoiser, DisoccludedSurfacesCatchUpInTwelveFrames) {
  const float p = 0.5f;
  const auto covered = [](uint32_t f, uint32_t x, uint32_t y) { // a card that moves right by 16 pixels in frame 40
    const uint32_t left = f < 40 ? 40 : 56;
    return x >= left && x < left + 40 && y >= 20 && y < 76;
  };
  AoDenoiser denoiser;
  for (uint32_t f = 0; f < 52; ++f) {
    GBuffer g = wall(kMotionSize);
    for (uint32_t i = 0; i < kMotionSize.pixels(); ++i) {
      if (!covered(f, i % kMotionSize.width, i / kMotionSize.width)) continue;
      g.view_z[i] = 5.0f, g.instance[i] = 1;
      if (f == 40) g.motion_px[i] = Vec2(16, 0);
    }
    const DenoisedAo& result = denoiser.next_frame(g, noise(kMotionSize, p, f));
    if (f == 40) {
      EXPECT_EQ(result.tspp[48 * kMotionSize.width + 48], 1.0f);                              // disoccluded
      EXPECT_EQ(result.tspp[48 * kMotionSize.width + 75], static_cast<float>(kMovingFrames)); // on the card
    }
    for (float ao : result.ao) ASSERT_TRUE(ao >= 0.0f && ao <= 1.0f);
    if (f != 51) continue;
    const auto truth = [&](uint32_t, uint32_t) { return expected(p); };
    EXPECT_LE(rmse_of(result.ao, kMotionSize, {40, 20, 56, 76}, truth),
              1.5 * rmse_of(result.ao, kMotionSize, {104, 0, 160, 96}, truth));
  }
}

/// Remaining fraction of an occlusion change 4, 8, 16 and 32 frames after the change.
std::array<double, 4> ghost(float before, float after, Rect changed, const DenoiserConfig& config = {}) {
  AoDenoiser denoiser(config);
  std::array<double, 4> left{};
  for (uint32_t f = 0; f < 96 + 32; ++f) {
    const AoFrame frame = samples(kMotionSize, [&](uint32_t x, uint32_t y) {
      const bool inside = x >= changed.x0 && x < changed.x1 && y >= changed.y0 && y < changed.y1;
      return noisy(inside && f < 96 ? before : after, x, y, f);
    });
    const DenoisedAo& result = denoiser.next_frame(wall(kMotionSize), frame);
    const double residual = std::abs(mean_of(result.ao, kMotionSize, changed) - static_cast<double>(expected(after))) /
                            std::abs(static_cast<double>(expected(before) - expected(after)));
    const uint32_t frames = f + 1 - std::min(f + 1, 96u);
    for (size_t i = 0; i < 4; ++i)
      if (frames == (4u << i)) left[i] = residual;
  }
  return left;
}

void expect_ghost_gone(const std::array<double, 4>& left) {
  EXPECT_LE(left[0], 0.5);
  EXPECT_LE(left[1], 0.25);
  EXPECT_LE(left[2], 0.10);
  EXPECT_LE(left[3], 0.03);
}

TEST(AoDenoiser, GhostOfARemovedOccluderFades) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  expect_ghost_gone(ghost(0.9f, 0.1f, {40, 20, 110, 76}));
  expect_ghost_gone(ghost(0.1f, 0.9f, {40, 20, 110, 76})); // an occluder that appears
}

TEST(AoDenoiser, GhostOfAChangeWithinTheNoiseFadesToo) { // AO changes by 0.15, noise has a deviation of 0.375
  const std::array<double, 4> left = ghost(0.6f, 0.4f, {40, 20, 110, 76});
  EXPECT_LE(left[2], 0.22);
  EXPECT_LE(left[3], 0.12);
}

TEST(AoDenoiser, GhostOfAThinOccluderFades) {
  const std::array<double, 4> left = ghost(0.95f, 0.05f, {80, 20, 83, 76});
  EXPECT_LE(left[2], 0.2);
  EXPECT_LE(left[3], 0.1);
}

TEST(AoDenoiser, WithoutCorrectionGhostsStay) { // shows that the tests above can fail
  DenoiserConfig config;
  config.ours.change_tolerance = 1.0f;
  EXPECT_GT(ghost(0.9f, 0.1f, {40, 20, 110, 76}, config)[3], 0.5);
}

} // namespace
} // namespace packtrace
