#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <optional>
#include <set>

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <webp/decode.h>

#include "compress/exchange/gltf/image_codec.h"
#include "compress/exchange/gltf/plain_primitives.h"
#include "pbrt_import/base/diagnostics.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/import_scene.h"
#include "tests/compress/gltf_round_trip.h"
#include "tests/compress/gltf_test_support.h"
#include "tests/compress/test_scenes.h"
#include "tests/compress/world_faces.h"
#include "tests/temporary_folder.h"

namespace packtrace {
namespace {

using namespace gltf_test;

Scene scene_with_images() {
  Scene scene = test::mixed_scene();
  AlbedoTexture texture;
  texture.width = 40, texture.height = 24;
  for (uint32_t i = 0; i < texture.width * texture.height; ++i) {
    texture.rgb.push_back(static_cast<uint8_t>(i % 40 * 6));
    texture.rgb.push_back(static_cast<uint8_t>(i / 40 * 10));
    texture.rgb.push_back(90);
  }
  texture.uv_scale = {2.0f, 3.0f};
  scene.textures.push_back(std::move(texture));
  scene.materials.front().albedo_texture = 0;
  scene.materials.front().flags |= kAlbedoTexture;
  return scene;
}

using test::world_faces;
using test::WorldFace;

double largest_step(const BakedFile& file) {
  double step = 0.0;
  for (uint32_t i = 0; i < file.instances().size(); ++i) {
    const baked::GeometryRecord& g = file.geometries()[file.instances()[i].geometry];
    const Affine map = file.world_from_object(i);
    const double scale = double{glm::length(map[0])} + double{glm::length(map[1])} + double{glm::length(map[2])};
    step = std::max(step, PositionGrid{g.step_mantissa, g.step_exponent}.step() * scale);
  }
  return step;
}

class GltfProfiles : public testing::TestWithParam<GltfProfile> {
protected:
  TemporaryFolder folder_;
};
INSTANTIATE_TEST_SUITE_P(All, GltfProfiles,
                         testing::Values(GltfProfile::kPortable, GltfProfile::kWeb, GltfProfile::kExchange));

TEST_P(GltfProfiles, FilesComeBack) {
  const BakedScene baked = bake_for_shading(scene_with_images());
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  write(folder_ / "a.glb", export_of(file, gltf_profile(GetParam())).bytes);
  const BakedScene again = bake_again(folder_ / "a.glb");
  const BakedFile back = BakedFile::from_bytes(again.bytes);
  const std::multiset<WorldFace> before = world_faces(file), after = world_faces(back);
  ASSERT_EQ(before.size(), after.size());
  const double tolerance = largest_step(file);
  // Faces are sorted by their smallest corner; both sets have one order up to the tolerance along x.
  std::set<std::array<float, 3>> corners;
  for (const WorldFace& face : after) corners.insert(face.begin(), face.end());
  for (const WorldFace& face : before)
    for (const std::array<float, 3>& p : face) {
      double nearest = std::numeric_limits<double>::infinity();
      const auto reach = static_cast<float>(tolerance);
      for (auto q = corners.lower_bound({p[0] - reach, -1e30f, -1e30f}); q != corners.end() && (*q)[0] <= p[0] + reach;
           ++q)
        nearest = std::min(nearest, std::hypot(double{(*q)[0] - p[0]}, double{(*q)[1] - p[1]}, double{(*q)[2] - p[2]}));
      ASSERT_LE(nearest, tolerance);
    }
  const TextureView a = file.texture(0);
  std::optional<TextureView> found; // the mask's image is another texture
  for (uint32_t i = 0; i < back.sections().textures.size(); ++i)
    if (back.texture(i).width == a.width) found = back.texture(i);
  ASSERT_TRUE(found);
  for (uint32_t y = 0; y < a.height; ++y)
    for (uint32_t x = 0; x < a.width; ++x)
      for (size_t c = 0; c < 3; ++c) ASSERT_NEAR(a.texel(x, y)[c], found->texel(x, y)[c], 24) << x << " " << y;
}

TEST_P(GltfProfiles, BytesDoNotDependOnThreads) {
  const BakedScene baked = bake_for_shading(scene_with_images());
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  const GltfExport many = export_of(file, gltf_profile(GetParam()));
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(export_of(file, gltf_profile(GetParam())).bytes, many.bytes);
}

TEST_P(GltfProfiles, TextAndBufferHoldTheSame) {
  const BakedScene baked = bake_for_shading(scene_with_images());
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  GltfConfig config = gltf_profile(GetParam());
  write(folder_ / "a.glb", export_of(file, config).bytes);
  config.buffer_name = "a b.bin";
  const GltfExport apart = export_of(file, config);
  write(folder_ / "a.gltf", apart.bytes);
  write(folder_ / "a b.bin", apart.buffer);
  EXPECT_EQ(world_faces(BakedFile::from_bytes(bake_again(folder_ / "a.gltf").bytes)),
            world_faces(BakedFile::from_bytes(bake_again(folder_ / "a.glb").bytes)));
}

/// Faces of geometries that instances place, by the coordinates of their lattices. Each begins with its smallest
/// corner.
std::set<std::array<LatticePoint, 3>> instanced_faces(const BakedFile& file) {
  std::set<std::array<LatticePoint, 3>> faces;
  for (uint32_t g = 0; g < file.base_geometry_count(); ++g) {
    if ((file.geometries()[g].flags & baked::kWorldSpace) != 0) continue;
    for (const PlainPrimitive& part : plain_primitives(file, g))
      for (const Triangle& t : part.triangles) {
        std::array<LatticePoint, 3> face = {part.lattice[t.x], part.lattice[t.y], part.lattice[t.z]};
        std::rotate(face.begin(), std::min_element(face.begin(), face.end()), face.end());
        faces.insert(face);
      }
  }
  return faces;
}

/// Steps of the lattices of all geometries, or of those in world space only.
std::set<double> lattice_steps(const BakedFile& file, bool world_only) {
  std::set<double> steps;
  for (uint32_t g = 0; g < file.base_geometry_count(); ++g)
    if (!world_only || (file.geometries()[g].flags & baked::kWorldSpace) != 0)
      steps.insert(PositionGrid{file.geometries()[g].step_mantissa, file.geometries()[g].step_exponent}.step());
  return steps;
}

/// The lattice survives, though it is not the one that baking would choose: positions are equal bit for bit. `web`
/// rounds where instances are, and stores geometry of instances in steps, which their maps scale.
TEST_P(GltfProfiles, LatticesAreEqual) {
  BakeConfig coarse;
  coarse.precision_kind = PrecisionKind::kPositionBits;
  coarse.precision = 11;
  const BakedScene baked = test::bake(scene_with_images(), coarse);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  write(folder_ / "a.glb", export_of(file, gltf_profile(GetParam())).bytes);
  const BakedScene again = bake_again(folder_ / "a.glb");
  const BakedFile back = BakedFile::from_bytes(again.bytes);
  const bool web = GetParam() == GltfProfile::kWeb;
  ASSERT_FALSE(lattice_steps(file, web).empty());
  EXPECT_EQ(lattice_steps(back, web), lattice_steps(file, web));
  ASSERT_FALSE(instanced_faces(file).empty());
  EXPECT_EQ(instanced_faces(back), instanced_faces(file));
  if (web) {
    ASSERT_FALSE(world_faces(file, std::nullopt, true).empty());
    EXPECT_EQ(world_faces(back, std::nullopt, true), world_faces(file, std::nullopt, true));
  } else {
    EXPECT_EQ(world_faces(back), world_faces(file));
  }
}

TEST(GltfConfigs, SettingsOfOtherCodecsAreNotChecked) {
  GltfConfig config;
  config.draco.normal_bits = config.meshopt_normal_bits = 20;
  EXPECT_NO_THROW(validate(config));
  config.codec = GltfCodec::kMeshopt;
  EXPECT_THROW(validate(config), Error);
  config.meshopt_normal_bits = 16, config.draco.normal_bits = 40;
  EXPECT_NO_THROW(validate(config));
  config.codec = GltfCodec::kDraco;
  EXPECT_THROW(validate(config), Error);
}

TEST(GltfImages, ColoursOfTransparentPixelsStay) {
  const RgbaImage image{2, 2, {255, 0, 0, 255, 0, 200, 30, 0, 7, 8, 9, 0, 0, 0, 255, 255}};
  const WebpImage coded = encode_webp(image, 100.0);
  std::vector<uint8_t> decoded(image.pixels.size());
  ASSERT_NE(WebPDecodeRGBAInto(reinterpret_cast<const uint8_t*>(coded.bytes.data()), coded.bytes.size(), decoded.data(),
                               decoded.size(), 8),
            nullptr);
  EXPECT_EQ(decoded, image.pixels);
}

TEST(GltfPortable, UsesNoExtension) {
  Scene scene = scene_with_images();
  scene.materials.front().flags |= kTransmissive;
  const BakedScene baked = bake_for_shading(scene);
  const tinygltf::Model model =
      parse(export_of(BakedFile::from_bytes(baked.bytes), gltf_profile(GltfProfile::kPortable)));
  EXPECT_TRUE(model.extensionsUsed.empty());
  EXPECT_TRUE(model.extensionsRequired.empty());
  EXPECT_TRUE(std::ranges::any_of(model.materials, [](const auto& m) { return m.alphaMode == "BLEND"; }));
  for (const tinygltf::Material& material : model.materials)
    EXPECT_TRUE(material.pbrMetallicRoughness.baseColorTexture.extensions.empty());
}

TEST(GltfWeb, RegularMeshesAreStrips) {
  const BakedScene baked = test::bake(test::scene_of(test::grid_mesh(40)));
  GltfConfig config = gltf_profile(GltfProfile::kWeb);
  config.buffer_name = "a.bin";
  const GltfExport result = export_of(BakedFile::from_bytes(baked.bytes), config);
  const std::string_view text(reinterpret_cast<const char*>(result.bytes.data()), result.bytes.size());
  const nlohmann::json json = nlohmann::json::parse(text);
  const nlohmann::json& primitive = json["meshes"][0]["primitives"][0];
  constexpr int kTriangleStrip = 5;
  EXPECT_EQ(primitive.value("mode", 4), kTriangleStrip);
  const uint64_t indices = json["accessors"][primitive["indices"].get<size_t>()]["count"];
  EXPECT_GE(indices, result.report.triangles + 2);
  EXPECT_LT(indices, 2 * result.report.triangles); // a list has three
}

TEST(GltfWeb, StatesItsErrors) {
  const BakedScene baked = bake_for_shading(scene_with_images());
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  GltfConfig config = gltf_profile(GltfProfile::kWeb);
  const GltfReport bytes = export_of(file, config).report;
  EXPECT_GT(bytes.max_normal_error_degrees, 0.1);
  EXPECT_LT(bytes.max_normal_error_degrees, 1.5);
  EXPECT_GE(bytes.min_texture_psnr, 40.0);
  EXPECT_LE(bytes.max_placement_error, largest_step(file));
  config.meshopt_normal_bits = 12;
  EXPECT_LT(export_of(file, config).report.max_normal_error_degrees, 0.1);
}

TEST(GltfWeb, MergesWhatHasOneMaterial) {
  Scene scene = test::scene_of(test::grid_mesh(8));
  for (int i = 1; i < 6; ++i)
    test::add_shape(scene, test::grid_mesh(8 + static_cast<uint32_t>(i)), test::translation({2.0 * i, 0, 0}));
  const BakedScene baked = test::bake(scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  ASSERT_EQ(file.geometries().size(), 6u);
  EXPECT_EQ(export_of(file, gltf_profile(GltfProfile::kWeb)).report.meshes, 1u);
  EXPECT_EQ(export_of(file, gltf_profile(GltfProfile::kExchange)).report.meshes, 6u);
}

TEST(GltfLevels, CoverageFallsWithTheLevels) {
  const Scene scene = test::scene_of(test::sphere_mesh(40));
  BakeConfig bake;
  bake.lod = LodUse::kAll;
  const BakedScene baked = test::bake(scene, bake);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  const size_t levels = file.lod(0).levels.size();
  ASSERT_GT(levels, 2u);
  GltfConfig config = plain();
  config.levels = true;
  const GltfExport result = export_of(file, config);
  EXPECT_EQ(result.report.levels, levels - 1);
  const tinygltf::Model model = parse(result);
  const auto node = std::ranges::find_if(model.nodes, [](const auto& n) { return n.extensions.count("MSFT_lod") > 0; });
  ASSERT_NE(node, model.nodes.end());
  EXPECT_EQ(node->extensions.at("MSFT_lod").Get("ids").ArrayLen(), levels - 1);
  const tinygltf::Value& coverage = node->extras.Get("MSFT_screencoverage");
  ASSERT_EQ(coverage.ArrayLen(), levels);
  const Bounds box = object_bounds(file.geometries()[0]);
  for (size_t i = 0; i + 1 < levels; ++i) {
    const double error = double{file.lod(0).levels[i + 1].error};
    EXPECT_DOUBLE_EQ(coverage.Get(static_cast<int>(i)).GetNumberAsDouble(),
                     std::min(1.0, box.diagonal() / (error * 1080.0)));
    EXPECT_GE(coverage.Get(static_cast<int>(i)).GetNumberAsDouble(),
              coverage.Get(static_cast<int>(i + 1)).GetNumberAsDouble());
  }
}

TEST(GltfExport, BrokenNamesAreWrittenAsUtf8) {
  Scene scene = test::scene_of(test::grid_mesh(4));
  scene.materials[0].name = "b\xe4um \xff\xc3 \xed\xa0\x80";
  scene.meshes[0].name = "\xe9\x80\x00t\xc3"; // Latin-1, then a truncated character
  Camera camera;
  camera.film_name = "\xfc.exr";
  scene.cameras.push_back(camera);
  const BakedScene baked = test::bake(scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  for (const GltfProfile profile : {GltfProfile::kPortable, GltfProfile::kExchange}) {
    const tinygltf::Model model = parse(export_of(file, gltf_profile(profile)));
    EXPECT_TRUE(model.materials[0].name.starts_with("b\u00e4um \u00ff")) << model.materials[0].name;
    EXPECT_EQ(model.cameras[0].name, "\u00fc.exr");
  }
}

} // namespace
} // namespace packtrace
