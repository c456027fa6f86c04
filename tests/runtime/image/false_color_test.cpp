#include "runtime/image/false_color.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include <gtest/gtest.h>

#include "runtime/image/png.h"

namespace packtrace {
namespace {

Vec3 color_at(const Image& image, uint32_t x) {
  const auto p = image.pixel(x, 0);
  return {p[0], p[1], p[2]};
}

double lightness(Vec3 display) {
  return 0.2126 * linear_from_srgb(display.x) + 0.7152 * linear_from_srgb(display.y) +
         0.0722 * linear_from_srgb(display.z);
}

const Vec3 kMissing(1, 0, 1);

TEST(FalseColor, AoPicturesDecodeToTheirValues) {
  const std::vector<float> ao{0.0f, 0.25f, 1.0f, kInvalidAo};
  const Image picture = ao_preview({4, 1}, ao, kMissing);
  const Image read = decode_png(encode_png(picture, PngTransfer::kRaw), "memory", PngTransfer::kSrgb);
  for (uint32_t x = 0; x < 3; ++x) EXPECT_NEAR(read.pixel(x, 0)[0], ao[x], 0.004) << x;
  EXPECT_EQ(color_at(picture, 3), kMissing);
}

TEST(FalseColor, NearIsBrighterThanFar) {
  std::vector<float> depth(200);
  for (size_t i = 0; i < depth.size(); ++i) depth[i] = std::exp(static_cast<float>(i) * 0.02f);
  const Image picture = depth_preview({200, 1}, depth);
  for (uint32_t x = 3; x < 198; ++x)
    EXPECT_GT(lightness(color_at(picture, x - 1)), lightness(color_at(picture, x))) << x;
}

TEST(FalseColor, OneFarPixelDoesNotChangeTheRestOfADepthPicture) {
  std::vector<float> depth(1000);
  for (size_t i = 0; i < depth.size(); ++i) depth[i] = 1.0f + static_cast<float>(i % 100) * 0.01f;
  const Image before = depth_preview({1000, 1}, depth);
  depth[500] = 1e9f;
  const Image after = depth_preview({1000, 1}, depth);
  EXPECT_LT(glm::length(color_at(before, 20) - color_at(after, 20)), 0.05f);
}

TEST(FalseColor, DepthsThatAreNoneAreMissing) {
  const std::vector<float> depth{0.0f, -1.0f, std::numeric_limits<float>::quiet_NaN(),
                                 std::numeric_limits<float>::infinity(), 2.0f};
  const Image picture = depth_preview({5, 1}, depth, kMissing);
  for (uint32_t x = 0; x < 4; ++x) EXPECT_EQ(color_at(picture, x), kMissing);
  EXPECT_NE(color_at(picture, 4), kMissing);
  EXPECT_EQ(color_at(depth_preview({1, 1}, std::vector<float>{0.0f}, kMissing), 0), kMissing);
}

TEST(FalseColor, NormalsMapToTheUnitCube) {
  const std::vector<Vec3> normals{{1, 0, 0}, {0, -1, 0}, {0, 0, 0}};
  const Image picture = normal_preview({3, 1}, normals, kMissing);
  EXPECT_EQ(color_at(picture, 0), Vec3(1.0f, 0.5f, 0.5f));
  EXPECT_EQ(color_at(picture, 1), Vec3(0.5f, 0.0f, 0.5f));
  EXPECT_EQ(color_at(picture, 2), kMissing);
}

TEST(FalseColor, NeighbouringIdsAreTellableApart) {
  for (uint32_t id = 0; id < 1000; ++id) EXPECT_GT(glm::length(id_color(id) - id_color(id + 1)), 0.2f) << id;
  std::set<std::tuple<int, int, int>> codes;
  for (uint32_t id = 0; id < 64; ++id) {
    const Vec3 c = id_color(id) * 255.0f;
    codes.insert({static_cast<int>(c.x), static_cast<int>(c.y), static_cast<int>(c.z)});
    EXPECT_GT(lightness(id_color(id)), 0.1) << "ids must not be near black, which means missing";
  }
  EXPECT_EQ(codes.size(), 64u);
  const Image picture = id_preview({2, 1}, std::vector<uint32_t>{7, kNoInstance}, kMissing);
  EXPECT_EQ(color_at(picture, 0), id_color(7));
  EXPECT_EQ(color_at(picture, 1), kMissing);
}

TEST(FalseColor, HeatGrowsFromBlackToWhite) {
  EXPECT_EQ(heat_color(0.0f), Vec3(0));
  EXPECT_EQ(heat_color(1.0f), Vec3(1));
  EXPECT_EQ(heat_color(1.0f / 3.0f), Vec3(1, 0, 0));
  EXPECT_EQ(heat_color(std::numeric_limits<float>::quiet_NaN()), Vec3(0));
  for (float t = 0.0f; t < 0.99f; t += 0.01f) EXPECT_LT(lightness(heat_color(t)), lightness(heat_color(t + 0.01f)));
  const Image map = heat_map({3, 1}, std::vector<float>{0.05f, 0.1f, 7.0f}, 0.1f);
  EXPECT_EQ(color_at(map, 0), heat_color(0.5f));
  EXPECT_EQ(color_at(map, 1), Vec3(1));
  EXPECT_EQ(color_at(map, 2), Vec3(1));
}

TEST(FalseColor, MagnitudesGrowBrighter) {
  for (float t = 0.0f; t < 0.99f; t += 0.01f)
    EXPECT_LT(lightness(scalar_color(t)), lightness(scalar_color(t + 0.01f))) << t;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const Image picture = scalar_preview({4, 1}, std::vector<float>{0.0f, 4.0f, 9.0f, nan}, 8.0f);
  EXPECT_EQ(color_at(picture, 0), scalar_color(0.0f));
  EXPECT_EQ(color_at(picture, 1), scalar_color(0.5f));
  EXPECT_EQ(color_at(picture, 2), scalar_color(1.0f));
  EXPECT_EQ(color_at(picture, 3), scalar_color(0.0f));
  EXPECT_EQ(scale_end(std::vector<float>{0.0f, nan}), 1.0f);
  EXPECT_EQ(scale_end(std::vector<float>(100, 3.0f)), 3.0f);
}

TEST(FalseColor, DirectionsHaveTheirHues) {
  const float inf = std::numeric_limits<float>::infinity();
  const std::vector<Vec2> vectors{{2, 0}, {0, 1}, {-1, 0}, {0, -1}, {0, 0}, {inf - inf, 0}};
  const Image picture = vector_preview({6, 1}, vectors, 1.0f);
  for (uint32_t x = 0; x < 4; ++x)
    EXPECT_LT(glm::length(color_at(picture, x) - direction_color(0.25f * static_cast<float>(x))), 1e-3f) << x;
  EXPECT_EQ(color_at(picture, 4), color_at(picture, 5));
  for (uint32_t a = 0; a < 5; ++a)
    for (uint32_t b = 0; b < a; ++b) EXPECT_GT(glm::length(color_at(picture, a) - color_at(picture, b)), 0.2f);
}

TEST(LevelPreview, ShowsLevelsByHueAndClustersByLightness) {
  for (uint32_t a = 0; a < 9; ++a)
    for (uint32_t b = 0; b < a; ++b) EXPECT_GT(glm::length(level_color(a) - level_color(b)), 0.15f) << a << ' ' << b;
  EXPECT_EQ(level_color(8), level_color(40));
  const std::vector<uint32_t> levels{1, 1, 1, 2}, clusters{7, 7, 8, 7};
  const std::vector<float> shade{1.0f, -1.0f, 1.0f, 0.25f};
  const Image image = level_preview({4, 1}, levels, clusters, shade, Vec3(0.25f, 0.5f, 0.75f));
  const auto color = [&](size_t i) { return Vec3(image.data[3 * i], image.data[3 * i + 1], image.data[3 * i + 2]); };
  EXPECT_EQ(color(1), Vec3(0.25f, 0.5f, 0.75f));
  EXPECT_NE(color(0), color(2));
  EXPECT_NEAR(color(0).x / color(0).y, color(2).x / color(2).y, 1e-4f); // clusters of a level share its hue
  EXPECT_LT(color(3).x, color(0).x);                                    // occluded pixels are darker
}

} // namespace
} // namespace packtrace
