#include "compress/format/shading/shading_codec.h"

#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include "compress/format/file/file_summary.h"
#include "compress/format/shading/shading_fields.h"
#include "pbrt_import/base/error.h"
#include "tests/compress/file_damage.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

/// A scene with each property of a material, each kind of light, and a map.
Scene shaded_scene() {
  Scene scene = test::scene_of(test::sphere_mesh(8));
  scene.has_shading = true;
  for (int i = 1; i < 10; ++i) {
    Material material = scene.materials[0];
    SurfaceShading& s = material.shading;
    material.name = "m" + std::to_string(i);
    if (i == 1) s.diffuse = 0.25f;
    if (i == 2) s.specular = {0.1f, 0.2f, 0.3f}, s.bits = kFresnelSchlick | kSpecularTimesAlbedo;
    if (i == 3) s.transmission = Vec3(0.9f), s.bits = kFresnelDielectric | kThin;
    if (i == 4) s.emission = {100.0f, 50.0f, 1e-3f}, s.bits = kOuterSideOpposite;
    if (i == 5) s.metal_eta = Vec3(0.2f), s.metal_k = Vec3(3.0f), s.bits = kFresnelConductor;
    if (i == 6) s.eta = 1.33f;
    if (i == 7) s.roughness = 0.1f;
    if (i == 8) s.sigma = 20.0f;
    if (i == 9)
      s = {kAllShadingBits, 0.5f, Vec3(0.1f), Vec3(0.2f), Vec3(0.3f), Vec3(2.0f), Vec3(3.0f), 1.4f, 0.5f, 10.0f};
    scene.materials.push_back(material);
    test::add_shape(scene, test::sphere_mesh(4), test::translation({3.0 * i, 0, 0}), static_cast<uint32_t>(i));
  }
  Light point, spot, distant, sky;
  point.position = {1, 2, 3}, point.radiance = {4, 5, 6};
  spot.kind = LightKind::kSpot, spot.cos_outer = 0.5f, spot.cos_inner = 0.75f, spot.direction = {0, 1, 0};
  distant.kind = LightKind::kDistant, distant.direction = {1, 0, 0};
  sky.kind = LightKind::kInfinite, sky.map = 0, sky.world_from_light = glm::mat3(0, 1, 0, 0, 0, 1, 1, 0, 0);
  scene.lights = {point, spot, distant, sky};
  scene.environment_maps.push_back(
      {"sky.exr", 3, 2, {Vec3(0), Vec3(1), Vec3(0.1f, 0.2f, 0.3f), Vec3(1e-6f), Vec3(7e4f), Vec3(255)}});
  return scene;
}

TEST(ShadingCodec, ReturnsWhatItWasGiven) {
  const Scene scene = shaded_scene();
  const ShadingData data = read_shading(encode_shading(scene), scene.materials.size());
  ASSERT_EQ(data.materials.size(), scene.materials.size());
  for (size_t i = 0; i < data.materials.size(); ++i) EXPECT_EQ(data.materials[i], scene.materials[i].shading) << i;
  ASSERT_EQ(data.lights.size(), scene.lights.size());
  for (size_t i = 0; i < data.lights.size(); ++i) EXPECT_EQ(data.lights[i], scene.lights[i]) << i;
  ASSERT_EQ(data.maps.size(), 1u);
  const EnvironmentMap &map = data.maps[0], &source = scene.environment_maps[0];
  EXPECT_EQ(map.name, source.name);
  ASSERT_EQ(map.radiance.size(), source.radiance.size());
  for (size_t i = 0; i < map.radiance.size(); ++i) {
    const float largest = std::max({source.radiance[i].x, source.radiance[i].y, source.radiance[i].z});
    for (int c = 0; c < 3; ++c) EXPECT_LE(std::abs(map.radiance[i][c] - source.radiance[i][c]), largest / 256.0f) << i;
  }
}

TEST(ShadingCodec, PlainMaterialsTakeFourBytes) {
  Scene scene;
  scene.materials.resize(100);
  EXPECT_EQ(encode_shading(scene).size(), 12u + 4u * 100u);
}

TEST(ShadingCodec, RefusesEveryTruncation) {
  const Scene scene = shaded_scene();
  std::vector<uint8_t> stream = encode_shading(scene);
  EXPECT_FALSE(find_shading_fault(stream, scene.materials.size()));
  for (size_t bytes = 0; bytes < stream.size(); ++bytes)
    EXPECT_TRUE(find_shading_fault(std::span(stream).first(bytes), scene.materials.size())) << bytes;
  stream.push_back(0);
  EXPECT_EQ(find_shading_fault(stream, scene.materials.size()), "bytes after its end");
}

TEST(ShadingCodec, ReadsNoChangedByteOutOfRange) {
  const Scene scene = shaded_scene();
  const std::vector<uint8_t> stream = encode_shading(scene);
  uint64_t refused = 0;
  for (size_t at = 0; at < stream.size(); ++at)
    for (const uint8_t change : std::initializer_list<uint8_t>{0x01, 0x80, 0xff}) {
      std::vector<uint8_t> changed = stream;
      changed[at] ^= change;
      if (find_shading_fault(changed, scene.materials.size())) {
        ++refused;
        continue;
      }
      const ShadingData data = read_shading(changed, scene.materials.size());
      for (const SurfaceShading& s : data.materials)
        EXPECT_TRUE(s.diffuse >= 0.0f && s.diffuse <= 1.0f && s.eta >= 1.0f && is_finite(s.emission) &&
                    s.roughness >= 0.0f && s.roughness <= 2.0f && (s.bits & ~kAllShadingBits) == 0);
      for (const Light& light : data.lights) {
        EXPECT_TRUE(is_finite(light.radiance) && light.radiance.x >= 0.0f && is_finite(light.position));
        EXPECT_TRUE(light.map == kNoMap || light.map < data.maps.size());
      }
    }
  EXPECT_GT(refused, stream.size() / 2);
}

TEST(ShadingCodec, RefusesScenesThatItCannotStore) {
  const auto kind = [](const Scene& scene) {
    try {
      encode_shading(scene);
    } catch (const Error& error) {
      return error.kind();
    }
    return ErrorKind::kCancelled;
  };
  Scene scene = shaded_scene();
  scene.materials[0].shading.eta = NAN;
  EXPECT_EQ(kind(scene), ErrorKind::kInput);
  scene = shaded_scene();
  scene.lights[0].radiance.x = -1.0f;
  EXPECT_EQ(kind(scene), ErrorKind::kInput);
  scene = shaded_scene();
  scene.environment_maps[0].radiance.pop_back();
  EXPECT_EQ(kind(scene), ErrorKind::kInput);
  scene = shaded_scene();
  scene.environment_maps[0].name.assign(5000, 'x');
  EXPECT_EQ(kind(scene), ErrorKind::kLimitExceeded);
}

TEST(ShadingSection, IsOnlyInFilesForShading) {
  const Scene scene = shaded_scene();
  BakeConfig config;
  const BakedFile ao = BakedFile::from_bytes(test::bake(scene, config).bytes);
  EXPECT_FALSE(ao.has_shading());
  EXPECT_EQ(ao.materials()[2].shading, SurfaceShading{});
  EXPECT_EQ(summarize(ao).bytes.shading_materials, 0u);
  config.purpose = baked::kShading;
  for (const PageCodec codec : {PageCodec::kNone, PageCodec::kFast, PageCodec::kSmall}) {
    config.codec = codec;
    const BakedFile file = BakedFile::from_bytes(test::bake(scene, config).bytes);
    ASSERT_TRUE(file.has_shading());
    const std::vector<Material> materials = file.materials();
    ASSERT_EQ(materials.size(), scene.materials.size());
    for (size_t i = 0; i < materials.size(); ++i) EXPECT_EQ(materials[i].shading, scene.materials[i].shading);
    EXPECT_EQ(file.shading().lights.size(), 4u);
    const FileSummary summary = summarize(file);
    EXPECT_EQ(summary.bytes.shading_materials + summary.bytes.lights + summary.bytes.environment_maps,
              encode_shading(scene).size());
    EXPECT_EQ(summary.lights, 4u);
    EXPECT_EQ(summary.area_light_materials, 2u);
  }
}

TEST(ShadingSection, FilesForAmbientOcclusionKeepTheirSize) {
  // Neither the header nor the summary takes more multiples of the alignment than in version 8, and the texture bytes
  // of such files are empty.
  EXPECT_EQ(sizeof(baked::FileHeader), 576u);
  EXPECT_EQ((sizeof(baked::SummaryRecord) + 63) / 64, 4u);
  const std::vector<std::byte> bytes = test::bake(shaded_scene(), {}).bytes;
  baked::FileHeader header;
  std::memcpy(&header, bytes.data(), sizeof header);
  EXPECT_EQ(header.sections[baked::kTextureBytes].bytes, 0u);
}

TEST(ShadingSection, DamageIsNamed) {
  BakeConfig config;
  config.purpose = baked::kShading;
  const std::vector<std::byte> bytes = test::bake(shaded_scene(), config).bytes;
  const size_t at = offsetof(baked::SummaryRecord, shading_bytes);
  EXPECT_NE(test::message_after(bytes, baked::kSummary, at, 1u << 30).find("shading 0: extent"), std::string::npos);
  EXPECT_NE(test::message_after(bytes, baked::kSummary, at, 16).find("shading 0: "), std::string::npos);
  EXPECT_NE(test::message_after(bytes, baked::kTextureBytes, 0, 77).find("number of materials"), std::string::npos);
  EXPECT_NE(test::message_after(bytes, baked::kTextureBytes, 12, 1u << 20).find("material bits"), std::string::npos);
}

} // namespace
} // namespace packtrace
