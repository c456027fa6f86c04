#include "runtime/denoise/denoiser.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/runtime/denoise/synthetic.h"

namespace packtrace {
namespace {

using namespace synthetic;

constexpr ImageSize kEdgeSize{64, 512};
constexpr uint32_t kEdge = 32; ///< first column of the right side

/// Denoises an image with noise left of kEdge and AO 1 to its right. Returns the largest error on the right side. The
/// left side is noisy so that the edge can be found from the guides only, not from the values.
float worst_leak(const GBuffer& g, uint32_t frames) {
  AoDenoiser denoiser;
  float worst = 0;
  for (uint32_t f = 0; f < frames; ++f) {
    const AoFrame frame =
        samples(kEdgeSize, [&](uint32_t x, uint32_t y) { return x < kEdge ? noisy(0.5f, x, y, f) : 1.0f; });
    const DenoisedAo& result = denoiser.next_frame(g, frame);
    for (uint32_t y = 0; y < kEdgeSize.height; ++y)
      for (uint32_t x = kEdge; x < kEdgeSize.width; ++x)
        worst = std::max(worst, 1.0f - result.ao[static_cast<size_t>(y) * kEdgeSize.width + x]);
  }
  return worst;
}

GBuffer walls(const std::function<void(GBuffer&, size_t i, uint32_t x)>& change) {
  GBuffer g = wall(kEdgeSize);
  for (uint32_t y = 0; y < kEdgeSize.height; ++y)
    for (uint32_t x = 0; x < kEdgeSize.width; ++x) change(g, static_cast<size_t>(y) * kEdgeSize.width + x, x);
  return g;
}

TEST(DenoiserEdges, WithoutAnEdgeInTheGuidesNoiseDoesSpread) { // shows that the tests below can fail
  EXPECT_GT(worst_leak(wall(kEdgeSize), 1), 0.05f);
}

TEST(DenoiserEdges, DepthStepOfATenthDoesNotLeak) {
  for (float step : {0.9f, 1.1f})
    EXPECT_LE(worst_leak(walls([&](GBuffer& g, size_t i, uint32_t x) {
                           if (x >= kEdge) g.view_z[i] *= step;
                         }),
                         16),
              0.01f)
        << step;
}

TEST(DenoiserEdges, DepthStepBehindASteepSurfaceDoesNotLeak) {
  EXPECT_LE(worst_leak(walls([&](GBuffer& g, size_t i, uint32_t x) { // a slanted plane: disparity is linear in x
                         const float slope = 1.0f / (0.1f + 0.002f * static_cast<float>(x));
                         g.view_z[i] = x < kEdge ? slope : 2.0f * slope;
                         g.normal[i] = glm::normalize(Vec3(0.7f, 0, -0.7f));
                       }),
                       16),
            0.01f);
}

TEST(DenoiserEdges, RightAngleCreaseDoesNotLeak) {
  EXPECT_LE(worst_leak(walls([&](GBuffer& g, size_t i, uint32_t x) {
                         const float c = std::sqrt(0.5f);
                         g.view_z[i] = 10.0f - 0.01f * std::abs(static_cast<float>(x) - 31.5f);
                         g.normal[i] = Vec3(x < kEdge ? -c : c, 0, -c);
                       }),
                       16),
            0.01f);
}

TEST(DenoiserEdges, MissesDoNotLeak) {
  AoDenoiser denoiser;
  const GBuffer g = walls([](GBuffer& b, size_t i, uint32_t x) {
    if (x < kEdge) b.view_z[i] = 0.0f, b.normal[i] = Vec3(0), b.instance[i] = kNoInstance;
  });
  const AoFrame frame = samples(kEdgeSize, [](uint32_t x, uint32_t) { return x < kEdge ? kInvalidAo : 0.8f; });
  const DenoisedAo& result = denoiser.next_frame(g, frame);
  for (size_t i = 0; i < kEdgeSize.pixels(); ++i)
    ASSERT_EQ(result.ao[i], i % kEdgeSize.width < kEdge ? kInvalidAo : 0.8f);
}

TEST(DenoiserEdges, TiltedPlanesBlurLikeFlatOnes) {
  const auto rmse = [](const GBuffer& g) {
    AoDenoiser denoiser;
    return rmse_of(denoiser.next_frame(g, noise(kEdgeSize, 0.5f, 3)).ao, kEdgeSize, all(kEdgeSize),
                   [](uint32_t, uint32_t) { return expected(0.5f); });
  };
  const double tilted = rmse(walls([](GBuffer& g, size_t i, uint32_t x) {
    g.view_z[i] = 1.0f / (0.05f + 0.004f * static_cast<float>(x)); // the right end is five times nearer
    g.normal[i] = glm::normalize(Vec3(1, 0, -0.2f));
  }));
  EXPECT_LE(tilted, 1.1 * rmse(wall(kEdgeSize)));
}

TEST(DenoiserEdges, CurvedSurfacesBlurLikeFlatOnes) {
  const auto rmse = [](const GBuffer& g, const char* setting) {
    DenoiserConfig config;
    config.set(setting);
    AoDenoiser denoiser(config);
    return rmse_of(denoiser.next_frame(g, noise(kEdgeSize, 0.5f, 3)).ao, kEdgeSize, all(kEdgeSize),
                   [](uint32_t, uint32_t) { return expected(0.5f); });
  };
  const GBuffer curved = walls([](GBuffer& g, size_t i, uint32_t x) {
    const float from_middle = static_cast<float>(x) - 31.5f;
    g.view_z[i] = 1.0f / (0.1f + 2e-5f * from_middle * from_middle); // 4 pixels away it leaves the plane by 0.3 %
  });
  const double flat = rmse(wall(kEdgeSize), "guide_bend=1.4");
  EXPECT_LE(rmse(curved, "guide_bend=1.4"), 1.1 * flat);
  EXPECT_GT(rmse(curved, "guide_bend=0"), 1.2 * flat);
}

TEST(DenoiserEdges, ContactShadowsOnOneSurfaceStaySharpOnceSampled) {
  AoDenoiser denoiser;
  const float left = 0.9f, right = 0.1f;
  const DenoisedAo* result = nullptr;
  for (uint32_t f = 0; f < 64; ++f)
    result = &denoiser.next_frame(wall(kEdgeSize), samples(kEdgeSize, [&](uint32_t x, uint32_t y) {
                                    return noisy(x < kEdge ? left : right, x, y, f);
                                  }));
  EXPECT_NEAR(mean_of(result->ao, kEdgeSize, {kEdge - 1, 0, kEdge, kEdgeSize.height}), expected(left), 0.01);
  EXPECT_NEAR(mean_of(result->ao, kEdgeSize, {kEdge, 0, kEdge + 1, kEdgeSize.height}), expected(right), 0.01);
}

/// Every pixel shows another leaf.
GBuffer foliage(ImageSize size) {
  GBuffer g = wall(size);
  for (uint32_t i = 0; i < size.pixels(); ++i) {
    g.view_z[i] = 5.0f + 45.0f * uniform(i, 1, 0);
    g.normal[i] = glm::normalize(Vec3(uniform(i, 2, 0) - 0.5f, uniform(i, 3, 0) - 0.5f, -0.3f));
  }
  return g;
}

TEST(AoDenoiser, LeavesWithoutNeighboursOnTheirSurfacesAreAveraged) {
  const ImageSize size{96, 64};
  AoDenoiser still, moving;
  const auto error = [&](const DenoisedAo& result) {
    return rmse_of(result.ao, size, all(size), [](uint32_t, uint32_t) { return expected(0.5f); });
  };
  EXPECT_LT(error(still.next_frame(foliage(size), noise(size, 0.5f, 0))), 0.4 * 0.375);
  GBuffer g = foliage(size);
  for (Vec2& motion : g.motion_px) motion = Vec2(200.0f, 0.0f); // all came into view
  moving.add_frame(foliage(size), noise(size, 0.5f, 0));
  EXPECT_LT(error(moving.next_frame(g, noise(size, 0.5f, 1))), 0.4 * 0.375);
}

TEST(AoDenoiser, WiresOnePixelWideDoNotMixWithTheWallBehind) {
  const ImageSize size{64, 48};
  const auto is_wire = [](uint32_t x, uint32_t y) { return x == 20 || (x > 30 && y == 24) || (x == y + 40); };
  GBuffer g = wall(size);
  const auto truth = [&](uint32_t x, uint32_t y) { return is_wire(x, y) ? 0.3f : 0.8f; };
  for (uint32_t y = 0; y < size.height; ++y)
    for (uint32_t x = 0; x < size.width; ++x)
      if (is_wire(x, y)) g.view_z[size_t{y} * size.width + x] = 4.0f;
  AoDenoiser denoiser;
  const DenoisedAo& result = denoiser.next_frame(g, samples(size, truth));
  for (uint32_t y = 2; y < size.height - 2; ++y) // corners of the wall that a wire cuts off are alone
    for (uint32_t x = 2; x < size.width - 2; ++x)
      EXPECT_NEAR(result.ao[size_t{y} * size.width + x], truth(x, y), 0.03f) << x << " " << y;
}

} // namespace
} // namespace packtrace
