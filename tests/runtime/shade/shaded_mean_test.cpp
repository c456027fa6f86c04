// Means of shaded frames along motion, with samples of known means.

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

#include "runtime/frame/shaded_filter.h"
#include "runtime/frame/shaded_mean.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

constexpr ImageSize kWallSize{64, 48};

/// A wall that fills the picture and moves over it.
GBuffer wall(Vec2 motion = Vec2(0.0f), Vec3 albedo = Vec3(0.5f)) {
  GBuffer g;
  g.resize(kWallSize);
  std::ranges::fill(g.view_z, 5.0f);
  std::ranges::fill(g.normal, Vec3(0, 0, -1));
  std::ranges::fill(g.albedo, albedo);
  std::ranges::fill(g.instance, 0u);
  std::ranges::fill(g.motion_px, motion);
  return g;
}

ShadedFrame frame_of(Vec3 direct, Vec3 specular) {
  const size_t n = kWallSize.pixels();
  return {kWallSize, std::vector<Vec3>(n, direct), std::vector<Vec3>(n, specular), std::vector<Vec3>(n, Vec3(0.25f))};
}

double mean_specular(const ShadedMean& mean) {
  double sum = 0.0;
  for (const ShadedPixel& p : mean.pixels()) sum += double{p.specular.y};
  return sum / static_cast<double>(kWallSize.pixels());
}

TEST(ShadedMean, RareReflectionsKeepTheirEnergyInMotion) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  for (const float chance : {0.02f, 0.1f, 0.5f}) {
    ShadedMean mean;
    std::mt19937 random(5);
    std::bernoulli_distribution seen(double{chance});
    double followed = 0.0;
    constexpr int kFrames = 64, kSettled = 16;
    for (int i = 0; i < kFrames; ++i) {
      ShadedFrame frame = frame_of(Vec3(0.0f), Vec3(0.0f));
      for (Vec3& value : frame.specular) value = Vec3(seen(random) ? 1.0f / chance : 0.0f);
      const GBuffer g = wall(Vec2(0.3f, 0.2f));
      mean.add(frame, g, i == 0 ? ShadedHistory::kNone : ShadedHistory::kMotion);
      mean.keep_surfaces(g);
      if (i >= kSettled) followed += mean_specular(mean) / (kFrames - kSettled);
    }
    EXPECT_NEAR(followed, 1.0, 0.05) << chance;
  }
}

TEST(ShadedMean, ReflectionsThatLeaveAreForgotten) {
  ShadedMean mean;
  const GBuffer g = wall(Vec2(0.3f, 0.2f));
  for (int i = 0; i < 16; ++i) {
    mean.add(frame_of(Vec3(0.0f), Vec3(1.0f)), g, i == 0 ? ShadedHistory::kNone : ShadedHistory::kMotion);
    mean.keep_surfaces(g);
  }
  // Pixels at the border have short histories, which are not limited.
  const size_t middle = kWallSize.pixels() / 2 + kWallSize.width / 2;
  EXPECT_NEAR(mean.pixels()[middle].specular.y, 1.0f, 1e-4f);
  mean.add(frame_of(Vec3(0.0f), Vec3(0.1f)), g, ShadedHistory::kMotion);
  EXPECT_NEAR(mean.pixels()[middle].specular.y, 0.1f, 0.01f);
}

TEST(ShadedMean, LightThatMovesOntoOtherAlbedosKeepsItsMean) {
  // Direct light of radiance 2 on an albedo that changes from frame to frame.
  for (const auto& [first, second] :
       {std::pair{0.0f, 0.5f}, {0.5f, 0.0f}, {0.01f, 0.9f}, {0.03f, 0.9f}, {0.4f, 0.5f}}) {
    ShadedMean mean;
    for (int i = 0; i < 9; ++i) {
      const float albedo = i % 2 == 0 ? second : first;
      const GBuffer g = wall(Vec2(0.3f, 0.2f), Vec3(albedo));
      mean.add(frame_of(Vec3(2.0f * albedo), Vec3(0.0f)), g, i == 0 ? ShadedHistory::kNone : ShadedHistory::kMotion);
      mean.keep_surfaces(g);
    }
    const ShadedPixel& p = mean.pixels()[kWallSize.pixels() / 2 + kWallSize.width / 2];
    EXPECT_NEAR(p.direct.y, 2.0f * second, 1e-4f) << first << " to " << second;
    EXPECT_GT(p.direct_frames, first == 0.4f ? 8.0f : 0.5f);
  }
}

TEST(ShadedMean, OtherMaterialsOfAnInstanceBeginAnew) {
  ShadedMean mean;
  GBuffer g = wall(Vec2(0.3f, 0.2f));
  mean.add(frame_of(Vec3(1.0f), Vec3(1.0f)), g, ShadedHistory::kNone);
  mean.keep_surfaces(g);
  std::ranges::fill(g.material, 1u);
  mean.add(frame_of(Vec3(0.0f), Vec3(0.0f)), g, ShadedHistory::kMotion);
  for (const ShadedPixel& p : mean.pixels()) EXPECT_EQ(p.direct + p.specular, Vec3(0.0f));
}

TEST(ShadedMean, SamplesThatAreNotFiniteAreDropped) {
  for (const ShadedHistory history : {ShadedHistory::kSamePixels, ShadedHistory::kMotion}) {
    ShadedMean mean;
    const GBuffer g = wall();
    for (int i = 0; i < 6; ++i) {
      ShadedFrame frame = frame_of(Vec3(1.0f), Vec3(2.0f));
      if (i % 2 == 0) frame.direct[100].x = NAN, frame.specular[200].y = INFINITY;
      EXPECT_EQ(mean.add(frame, g, i == 0 ? ShadedHistory::kNone : history), i % 2 == 0 ? 2u : 0u);
      mean.keep_surfaces(g);
    }
    for (const ShadedPixel& p : mean.pixels()) {
      EXPECT_EQ(p.direct, Vec3(1.0f));
      EXPECT_EQ(p.specular, Vec3(2.0f));
      EXPECT_EQ(p.ambient, Vec3(0.25f));
    }
    ShadedMean restored;
    EXPECT_TRUE(restored.restore(kWallSize.pixels(), mean.save()));
  }
}

TEST(ShadedFilter, NeighboursOfAnotherMaterialAreNotMixed) {
  GBuffer g = wall();
  std::vector<ShadedPixel> pixels(kWallSize.pixels()), filtered;
  const auto is_right = [](size_t i) { return i % kWallSize.width >= kWallSize.width / 2; };
  for (size_t i = 0; i < pixels.size(); ++i) {
    const float light = is_right(i) ? 2.0f : 1.0f; // with noise that would explain the difference
    pixels[i].direct = pixels[i].specular = Vec3(light);
    pixels[i].direct_square = pixels[i].specular_square = light * light + 1.0f;
    pixels[i].direct_frames = pixels[i].specular_frames = 5.0f;
  }
  const ShadedGuides guides{g.size, g.view_z, g.normal, g.instance, g.material, g.albedo};
  const size_t edge = kWallSize.width / 2 - 1;
  filter_shading(pixels, guides, filtered);
  EXPECT_GT(filtered[edge].direct.x, 1.1f);
  for (size_t i = 0; i < pixels.size(); ++i) g.material[i] = is_right(i);
  filter_shading(pixels, guides, filtered);
  EXPECT_NEAR(filtered[edge].direct.x, 1.0f, 1e-4f);
  EXPECT_NEAR(filtered[edge + 1].specular.x, 2.0f, 1e-4f);
}

} // namespace
} // namespace packtrace
