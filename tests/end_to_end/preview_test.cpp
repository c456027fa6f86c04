// Preview conventions of .png files: colours of pixels without a hit, and the meaning of the layers' colours.

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/image/background.h"
#include "runtime/image/legend.h"
#include "runtime/image/png.h"
#include "tests/end_to_end/workbench.h"

namespace packtrace::test {
namespace {

/// Renders the small scene: walls below, no hits in the upper corners.
Image rendered(const Workbench& bench, const std::vector<std::string>& options) {
  std::vector<std::string> words{"render", bench.scene(), "-o", bench / "x.png", "--frames", "1", "--force", "-q"};
  words.insert(words.end(), options.begin(), options.end());
  const CommandResult result = run_packtrace(words);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return read_png(bench / "x.png", PngTransfer::kRaw);
}

std::vector<float> corner_of(const Image& image) {
  const std::span<const float> pixel = image.pixel(0, 0);
  return {pixel.begin(), pixel.end()};
}

void expect_color(const Image& image, std::vector<float> expected) {
  const std::vector<float> corner = corner_of(image);
  ASSERT_EQ(corner.size(), expected.size());
  for (size_t i = 0; i < corner.size(); ++i) EXPECT_NEAR(corner[i], expected[i], 0.5f / 255 + 1e-4f) << i;
}

TEST(Preview, NothingIsToldFromAnOpenSurface) {
  const Workbench bench;
  const Vec3 usual = kDefaultBackground;
  for (const char* aov : {"ao", "ao_raw", "depth", "normal", "instance"})
    expect_color(rendered(bench, {"--aov", aov}), {usual.x, usual.y, usual.z});
  EXPECT_LT(usual.x, 0.9f) << "white is what is open";
  EXPECT_NE(usual.x, usual.z) << "all occlusion is neutral";
}

TEST(Preview, TheBackgroundCanBeChosen) {
  const Workbench bench;
  for (const char* name : {"#ff8000", "ff8000", "FF8000"})
    expect_color(rendered(bench, {"--background", name}), {1, 128.0f / 255, 0});
  expect_color(rendered(bench, {"--background", "#f80"}), {1, 136.0f / 255, 0});
  expect_color(rendered(bench, {"--background", "Black"}), {0, 0, 0});
  expect_color(rendered(bench, {"--background", "white", "--aov", "shaded"}), {1, 1, 1});
  const Image clear = rendered(bench, {"--background", "transparent", "--supersample", "2"});
  ASSERT_EQ(clear.channels, 4u);
  EXPECT_EQ(clear.pixel(0, 0)[3], 0.0f);
  EXPECT_EQ(clear.pixel(32, 40)[3], 1.0f);
  uint32_t quarters = 0; // pixels of which one or three samples hit
  for (size_t i = 3; i < clear.data.size(); i += 4)
    quarters += std::abs(clear.data[i] - 0.25f) < 0.01f || std::abs(clear.data[i] - 0.75f) < 0.01f;
  EXPECT_GT(quarters, 0u);
  for (const char* wrong : {"#ff80", "reddish", "", "#gggggg"})
    EXPECT_EQ(run_packtrace({"render", bench.scene(), "-o", bench / "y.png", "--background", wrong}).exit_code, 2)
        << wrong;
}

TEST(Preview, TheBackgroundIsNotInTheData) {
  const Workbench bench;
  const auto exr = [&](const char* background) {
    EXPECT_EQ(run_packtrace({"render", bench.scene(), "-o", bench / "x.exr", "--frames", "1", "--force", "--background",
                             background})
                  .exit_code,
              0);
    return read_text(bench / "x.exr");
  };
  EXPECT_EQ(exr("red"), exr("transparent"));
}

TEST(Preview, DepthHasALegendBelowThePicture) {
  const Workbench bench;
  const Image with = rendered(bench, {"--aov", "depth", "--size", "200x100"});
  const Image without = rendered(bench, {"--aov", "depth", "--size", "200x100", "--no-legend"});
  EXPECT_EQ(without.size, (ImageSize{200, 100}));
  EXPECT_EQ(with.size, (ImageSize{200, 100 + legend_height(200)}));
  EXPECT_TRUE(std::equal(without.data.begin(), without.data.end(), with.data.begin())) << "the picture stays as it is";
  EXPECT_EQ(rendered(bench, {"--aov", "ao", "--size", "200x100"}).size, (ImageSize{200, 100}));
}

TEST(Preview, LevelsOfDetailHaveLegends) {
  const Workbench bench;
  ASSERT_EQ(run_packtrace({"bake", bench.scene(), "-o", bench.baked(), "--lod", "-q"}).exit_code, 0);
  write_text(bench / "ball.pbrt",
             "LookAt 0 0 -4 0 0 0 0 1 0\nCamera \"perspective\"\nWorldBegin\nShape \"sphere\"\nWorldEnd\n");
  ASSERT_EQ(run_packtrace({"bake", bench / "ball.pbrt", "-o", bench / "ball.ptk", "--lod", "-q"}).exit_code, 0);
  ASSERT_EQ(run_packtrace({"render", bench / "ball.ptk", "-o", bench / "b.png", "--aov", "lod,lod-error", "--lod-error",
                           "1", "--frames", "1", "--size", "160x90"})
                .exit_code,
            0);
  for (const char* name : {"b.lod.png", "b.lod-error.png"})
    EXPECT_EQ(read_png(bench / name).size, (ImageSize{160, 90 + legend_height(160)})) << name;
}

TEST(Preview, LegendsFitPicturesOfAnySize) {
  for (const uint32_t width : {1u, 2u, 7u, 64u, 641u, 5000u}) {
    const Image picture({width, 2}, 3, 0.5f);
    const Legend legend{"depth, scene units", [](float t) { return Vec3(t); },
                        even_ticks([](float t) { return 1e-7 * double(t); })};
    EXPECT_EQ(with_legend(picture, legend).size, (ImageSize{width, 2 + legend_height(width)}));
  }
}

} // namespace
} // namespace packtrace::test
