// Textures of what camera rays and paths see, against pictures of many points per pixel.

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "tests/runtime/shade/shaded_scenes.h"

namespace packtrace {
namespace {

/// Random texels.
AlbedoTexture noise(uint32_t width, uint32_t height) {
  AlbedoTexture texture;
  texture.name = "noise", texture.width = width, texture.height = height;
  texture.rgb.resize(size_t{3} * width * height);
  std::mt19937 random(7);
  for (uint8_t& value : texture.rgb) value = static_cast<uint8_t>(random() >> 24);
  return texture;
}

/// Adds a floor that shows a texture `repeats` times along each axis, under a light from straight above.
void add_textured_floor(Scene& scene, AlbedoTexture texture, float repeats) {
  Mesh floor = test::floor_quad(8.0f);
  floor.uvs = {Vec2(0, 0), Vec2(0, repeats), Vec2(repeats, repeats), Vec2(repeats, 0)};
  const uint32_t shape = test::add_shaded(scene, std::move(floor), {});
  Material& material = scene.materials[scene.shapes[shape].material];
  material.albedo_texture = static_cast<uint32_t>(scene.textures.size());
  scene.textures.push_back(std::move(texture));
  Light light;
  light.kind = LightKind::kDistant, light.radiance = Vec3(3.0f), light.direction = Vec3(0, 1, 0);
  scene.lights.push_back(light);
}

/// Root mean square of the difference of a picture and the means of kFine x kFine pixels of another one.
constexpr uint32_t kFine = 12;
double rms_error(const std::vector<Vec3>& picture, const std::vector<Vec3>& fine, ImageSize size) {
  double sum = 0.0;
  for (uint32_t y = 0; y < size.height; ++y)
    for (uint32_t x = 0; x < size.width; ++x) {
      Vec3 mean(0.0f);
      for (uint32_t j = 0; j < kFine * kFine; ++j)
        mean += fine[size_t{y * kFine + j / kFine} * size.width * kFine + x * kFine + j % kFine];
      const Vec3 error = picture[size_t{y} * size.width + x] - mean / static_cast<float>(kFine * kFine);
      sum += static_cast<double>(glm::dot(error, error));
    }
  return std::sqrt(sum / (3.0 * static_cast<double>(size.pixels())));
}

constexpr ImageSize kSize{48, 32}, kFineSize{48 * kFine, 32 * kFine};

TEST(TexturePyramid, HoldsMeans) {
  for (const auto& [width, height] : {std::pair{16u, 16u}, {5u, 3u}, {1u, 7u}, {1u, 1u}, {31u, 2u}}) {
    Scene scene;
    add_textured_floor(scene, noise(width, height), 1.0f);
    const FloatSource source(scene);
    const TexturePyramids pyramids(source);
    const TextureView full = source.texture(0);
    Vec3 mean(0.0f);
    for (uint32_t y = 0; y < height; ++y)
      for (uint32_t x = 0; x < width; ++x)
        for (int c = 0; c < 3; ++c) mean[c] += linear_of_srgb8()[full.texel(x, y)[static_cast<size_t>(c)]];
    mean /= static_cast<float>(width * height);
    const Vec3 found = pyramids.mean(0, Vec2(0.4f, 0.7f), Vec2(64.0f, 0.0f), Vec2(0.0f, 64.0f));
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c], mean[c], 0.006f) << width << " x " << height;
    const Vec2 corner(0.1f, 0.2f), tiny(1e-3f);
    EXPECT_EQ(pyramids.mean(0, corner, tiny, tiny), full.sample(corner));
    EXPECT_LE(pyramids.bytes(), 3 * uint64_t{width} * height);
  }
}

TEST(TexturePyramid, WideFootprintsAreReadAlongTheirLongerSide) {
  Scene scene;
  AlbedoTexture stripes; // that depend on u alone
  stripes.width = stripes.height = 64;
  for (uint32_t i = 0; i < 64 * 64; ++i)
    for (int c = 0; c < 3; ++c) stripes.rgb.push_back(i % 64 < 32 ? 255 : 0);
  add_textured_floor(scene, std::move(stripes), 1.0f);
  const FloatSource source(scene);
  const TexturePyramids pyramids(source);
  const Vec2 narrow(1.0f / 64, 0.0f), wide(0.0f, 8.0f / 64); // the stripe's colour stays the same along v
  EXPECT_NEAR(pyramids.mean(0, Vec2(28.5f / 64, 0.5f), narrow, wide).x, 1.0f, 1e-3f);
  EXPECT_NEAR(pyramids.mean(0, Vec2(28.5f / 64, 0.5f), wide, narrow).x, 1.0f, 1e-3f);
  EXPECT_NEAR(pyramids.mean(0, Vec2(32.0f / 64, 0.5f), narrow, wide).x, 0.5f, 1e-3f);
}

TEST(TexturePyramid, TheMemoryBudgetPaysForTheLevels) {
  Scene scene;
  add_textured_floor(scene, noise(256, 128), 1.0f);
  const FloatSource source(scene);
  const MemoryBudget enough(1u << 20), little(100000);
  {
    const TexturePyramids pyramids(source, enough);
    EXPECT_EQ(enough.used(), pyramids.bytes());
    EXPECT_GT(pyramids.bytes(), 256u * 128);
  }
  EXPECT_EQ(enough.used(), 0u);
  EXPECT_THROW(TexturePyramids(source, little), MemoryError);
  EXPECT_EQ(little.used(), 0u);
}

TEST(TexturePyramid, SlantedFootprintsAreReadAlongTheirLongerAxis) {
  Scene scene;
  AlbedoTexture stripes; // along the diagonal
  stripes.width = stripes.height = 64;
  for (uint32_t i = 0; i < 64 * 64; ++i)
    for (int c = 0; c < 3; ++c) stripes.rgb.push_back((i % 64 + i / 64) % 16 < 8 ? 255 : 0);
  add_textured_floor(scene, std::move(stripes), 1.0f);
  const FloatSource source(scene);
  const TexturePyramids pyramids(source);
  constexpr int kPoints = 32;
  float largest = 0.0f;
  for (const float way : {1.0f, -1.0f}) { // along the stripes and across
    const Vec2 a = Vec2(5.0f, 5.0f * way) / 64.0f, b = Vec2(4.0f, 3.0f * way) / 64.0f;
    for (int place = 0; place < 16; ++place) {
      const Vec2 uv = Vec2(32.0f + static_cast<float>(place), 32.0f) / 64.0f;
      float truth = 0.0f;
      for (int k = 0; k < kPoints * kPoints; ++k) {
        const Vec2 at =
            (Vec2(static_cast<float>(k % kPoints), static_cast<float>(k / kPoints)) + 0.5f) / float{kPoints} - 0.5f;
        truth += source.texture(0).sample(uv + at.x * a + at.y * b).x / (kPoints * kPoints);
      }
      EXPECT_NEAR(pyramids.mean(0, uv, a, b).x, truth, 0.12f) << way << ", " << place;
      largest = std::max(largest, truth);
    }
  }
  EXPECT_GT(largest, 0.95f); // some footprints lie within a stripe
}

TEST(TexturePyramid, FootprintsOfAnyLengthHaveAMean) {
  Scene scene;
  add_textured_floor(scene, noise(16, 16), 1.0f);
  const FloatSource source(scene);
  const TexturePyramids pyramids(source);
  for (const float length : {1e3f, 1e9f, 1e15f, 1e30f, INFINITY}) {
    const Vec3 mean = pyramids.mean(0, Vec2(0.4f, 0.7f), Vec2(length, 0.0f), Vec2(0.0f, 1e-4f));
    for (int c = 0; c < 3; ++c) EXPECT_TRUE(mean[c] >= 0.0f && mean[c] <= 1.0f) << length;
  }
}

TEST(Textures, AreFilteredOverThePixel) {
  Scene scene;
  add_textured_floor(scene, noise(256, 256), 2.0f);
  test::ShadeBench bench(scene);
  const Camera camera = test::camera_at(DVec3(0, 1.5, -7), DVec3(0, 0, 2), 40.0);
  const auto albedo = [&](ImageSize size, float width_px) {
    bench.shade(camera, size, {}, 1, width_px);
    return bench.gbuffer.albedo;
  };
  const std::vector<Vec3> truth = albedo(kFineSize, 0.0f);
  const double points = rms_error(albedo(kSize, 0.0f), truth, kSize),
               filtered = rms_error(albedo(kSize, 1.0f), truth, kSize);
  RecordProperty("points", std::to_string(points));
  RecordProperty("filtered", std::to_string(filtered));
  EXPECT_LT(filtered, 0.25 * points);
}

TEST(Textures, AreFilteredInMirrors) {
  Scene scene;
  add_textured_floor(scene, noise(256, 256), 2.0f);
  test::add_shaded(scene, test::quad(Vec3(-20, 0, 8), Vec3(0, 20, 0), Vec3(40, 0, 0)),
                   test::specular_surface(kFresnelNone));
  test::ShadeBench bench(scene);
  const Camera camera = test::camera_at(DVec3(0, 6, 0), DVec3(0, 3, 8), 30.0); // sees the mirror alone
  ShadeConfig config;
  config.ambient = 0.0f;
  const auto seen = [&](ImageSize size, float width_px) {
    return bench.shade(camera, size, config, 1, width_px).specular;
  };
  const std::vector<Vec3> truth = seen(kFineSize, 0.0f);
  const double points = rms_error(seen(kSize, 0.0f), truth, kSize),
               filtered = rms_error(seen(kSize, 1.0f), truth, kSize);
  RecordProperty("points", std::to_string(points));
  RecordProperty("filtered", std::to_string(filtered));
  EXPECT_GT(points, 0.05); // the mirror shows the floor
  EXPECT_LT(filtered, 0.25 * points);
}

} // namespace
} // namespace packtrace
