#include "compress/exchange/gltf/export_losses.h"

#include <fstream>
#include <map>
#include <string>

#include <gtest/gtest.h>

#include "compress/exchange/scene/pbrt_export.h"
#include "pbrt_import/base/diagnostics.h"
#include "pbrt_import/import_scene.h"
#include "tests/compress/gltf_test_support.h"
#include "tests/compress/test_scenes.h"
#include "tests/temporary_folder.h"

namespace packtrace {
namespace {

using Counts = std::map<std::string, uint64_t>;

Counts counts_of(const std::vector<ExportLoss>& losses) {
  Counts counts;
  for (const ExportLoss& loss : losses) {
    EXPECT_GT(loss.count, 0u);
    EXPECT_FALSE(loss.what.empty());
    EXPECT_TRUE(counts.emplace(loss.key, loss.count).second) << loss.key;
  }
  return counts;
}

/// A small scene with one of everything that a format loses.
Scene lossy_scene() {
  const auto patch = [](uint32_t size) {
    Mesh mesh = test::grid_mesh(size);
    mesh.uvs.assign(mesh.positions.size(), Vec2(0.5f));
    return mesh;
  };
  Scene scene = test::scene_of(patch(3));
  scene.has_shading = true;
  scene.materials[0].flags = kNormalMap | kNoShadow;
  scene.materials[0].shading.roughness = 0.5f;
  scene.masks.push_back(test::striped_mask());
  scene.masks[0].wrap = WrapMode::kBlack;
  scene.materials.push_back({"unseen", kInvisible, Vec3(0.5f)});
  scene.materials.push_back({"glass", kTransmissive | kEmissive | kEmitsBothSides, Vec3(0.5f)});
  scene.materials.push_back({"veil", kShadowAlphaMask, Vec3(0.5f), kNoMask, 0});
  AlbedoTexture texture;
  texture.name = "bricks.png";
  texture.width = texture.height = 4;
  texture.rgb.assign(size_t{3} * 4 * 4, 100);
  scene.textures.push_back(std::move(texture));
  scene.materials.push_back({"wall", kAlbedoTexture, Vec3(0.127f), kNoMask, kNoMask, 0});
  for (uint32_t material = 1; material < scene.materials.size(); ++material)
    test::add_shape(scene, patch(3 + material), test::translation({0, 0, double(material)}), material);
  scene.meshes.push_back(patch(2));
  scene.objects.push_back({"tile", {Shape{static_cast<uint32_t>(scene.meshes.size() - 1), 0, false, DAffine(1.0)}}});
  for (const double x : {5.0, -5.0}) scene.instances.push_back({0, Affine(test::translation({x, 5, 5}))});
  scene.lights.resize(2);
  scene.cameras.resize(3);
  scene.cameras[1].screen_window = glm::dvec4(-0.5, 1, -1, 1);
  scene.cameras[2].projection = Projection::kEnvironment;
  return scene;
}

BakedScene baked_losses(const Scene& scene) {
  BakeConfig config;
  config.purpose = baked::kShading;
  config.textures = true;
  return test::bake(scene, config);
}

TEST(ExportLosses, EachFormatCountsWhatItLeavesOut) {
  const BakedScene baked = baked_losses(lossy_scene());
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  const Counts both = {{"normal_maps", 1}, {"surface_parameters", 1}, {"lights", 2}};
  Counts gltf = both;
  gltf.insert({{"shadow_masks", 1},
               {"invisible_materials", 1},
               {"unshadowing_materials", 1},
               {"black_borders", 1},
               {"shifted_windows", 1}});
  EXPECT_EQ(counts_of(find_losses(file, ExportFormat::kGltf, {true, true})), gltf);
  gltf["blended_materials"] = 1;
  EXPECT_EQ(counts_of(find_losses(file, ExportFormat::kGltf)), gltf);
  Counts obj = gltf;
  obj.erase("blended_materials"), obj.erase("shifted_windows");
  obj.insert({{"image_names", 1}, {"cameras", 3}, {"expanded_instances", 2}});
  EXPECT_EQ(counts_of(find_losses(file, ExportFormat::kObj)), obj);
  Counts pbrt = both;
  pbrt.insert({{"image_names", 1}, {"cameras", 2}});
  EXPECT_EQ(counts_of(find_losses(file, ExportFormat::kPbrt)), pbrt);
  const Counts streams = {{"surface_parameters", 1}, {"lights", 2}, {"images", 2}, {"cameras", 3}};
  EXPECT_EQ(counts_of(find_losses(file, ExportFormat::kStreams)), streams);
}

TEST(ExportLosses, LevelsCountUnlessTheyAreKept) {
  Scene scene = test::scene_of(test::sphere_mesh(40));
  BakeConfig config;
  config.lod = LodUse::kAll;
  const BakedScene baked = test::bake(scene, config);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  const uint64_t levels = file.geometries().size() - file.base_geometry_count();
  ASSERT_GT(levels, 0u);
  EXPECT_EQ(counts_of(find_losses(file, ExportFormat::kGltf, {false, true})), (Counts{{"levels", levels}}));
  EXPECT_EQ(counts_of(find_losses(file, ExportFormat::kGltf, {true, true})), Counts{});
  EXPECT_EQ(counts_of(find_losses(file, ExportFormat::kPbrt)), (Counts{{"levels", levels}}));
}

TEST(ExportLosses, ObjectsOfPbrtHaveNoAreaLights) {
  Scene scene = lossy_scene();
  scene.meshes.push_back(test::sphere_mesh(6));
  scene.objects[0].shapes[0].mesh = static_cast<uint32_t>(scene.meshes.size() - 1);
  scene.objects[0].shapes[0].material = 2;
  const BakedScene baked = baked_losses(scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  EXPECT_EQ(counts_of(find_losses(file, ExportFormat::kPbrt))["instanced_lights"], 1u);
  EXPECT_EQ(counts_of(find_losses(file, ExportFormat::kObj)).count("instanced_lights"), 0u);
}

TEST(ExportLosses, ExportsReportThem) {
  const BakedScene baked = baked_losses(lossy_scene());
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  const GltfReport report = gltf_test::export_of(file).report;
  EXPECT_EQ(counts_of(report.losses), counts_of(find_losses(file, ExportFormat::kGltf, {false, true})));
  EXPECT_EQ(report.skipped_cameras, 1u);
}

TEST(GltfExport, ImagesKeepTheirNames) {
  const BakedScene baked = baked_losses(lossy_scene());
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  GltfConfig config = gltf_test::plain();
  config.buffer_name = "a.bin";
  const GltfExport named = gltf_test::export_of(file, config);
  const auto json_of = [](const GltfExport& result) {
    return nlohmann::json::parse(reinterpret_cast<const char*>(result.bytes.data()),
                                 reinterpret_cast<const char*>(result.bytes.data()) + result.bytes.size());
  };
  const nlohmann::json images = json_of(named)["images"];
  ASSERT_EQ(images.size(), 1u);
  EXPECT_EQ(images[0]["name"], "bricks.png");
  config.names = false;
  const nlohmann::json unnamed = json_of(gltf_test::export_of(file, config));
  ASSERT_EQ(unnamed["images"].size(), 1u);
  EXPECT_FALSE(unnamed["images"][0].contains("name"));
}

TEST(PbrtExport, FlagsOfMaterialsComeBack) {
  const BakedScene baked = baked_losses(lossy_scene());
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  Progress progress;
  const TemporaryFolder folder;
  SceneExport result = export_pbrt(file, "a", progress);
  for (const ExportedFile& part : result.files) {
    const std::filesystem::path path = folder.path() / part.name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(part.bytes.data()), static_cast<std::streamsize>(part.bytes.size()));
  }
  Diagnostics diagnostics;
  const Scene scene = import_scene(folder.path() / "a.pbrt", {}, diagnostics, progress).scene;
  EXPECT_EQ(diagnostics.count(Severity::kWarning) + diagnostics.count(Severity::kError), 0u);
  MaterialFlags before = 0, after = 0;
  for (const Material& material : file.materials()) before |= material.flags;
  for (const Material& material : scene.materials) after |= material.flags;
  EXPECT_EQ(after, before & ~kNormalMap);
  EXPECT_EQ(after & (kInvisible | kNoShadow | kEmitsBothSides), kInvisible | kNoShadow | kEmitsBothSides);
}

} // namespace
} // namespace packtrace
