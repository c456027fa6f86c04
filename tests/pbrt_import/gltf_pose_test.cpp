// Skins, animated morph targets, and images of glTF files.

#include <cmath>
#include <cstring>
#include <set>

#include <webp/encode.h>

#include "tests/pbrt_import/gltf_documents.h"
#include "tests/pbrt_import/image_test_support.h"

namespace packtrace {
namespace {

using Json = nlohmann::json;

Imported import_at(const SceneFolder& folder, const GltfBuilder& gltf, double time = 0.0) {
  ImportOptions options;
  options.time = time;
  options.keep_textures = true;
  options.keep_shading = true;
  return import_file(folder.write("a.gltf", gltf.text()), options);
}

TEST(GltfSkins, VerticesFollowTheirJointsAtATime) {
  const SceneFolder folder;
  const Imported bound = import_at(folder, gltf_skin());
  EXPECT_TRUE(bound.reported("morph targets and skins stand as at 0 s")) << bound.text();
  ASSERT_EQ(bound.scene.shapes.size(), 1u);
  const std::vector<DVec3> rest = {{0, 0, 0}, {-1, 0, 0}, {0, 1, 0}}; // x is mirrored
  for (size_t i = 0; i < 3; ++i) EXPECT_LT(glm::distance(placed(bound.scene.shapes[0], bound.scene, i), rest[i]), 1e-6);
  const Imported later = import_at(folder, gltf_skin(), 1.0); // joint 1 moved by 4
  const std::vector<DVec3> moved = {{0, 0, 0}, {-1, 4, 0}, {0, 3, 0}};
  for (size_t i = 0; i < 3; ++i)
    EXPECT_LT(glm::distance(placed(later.scene.shapes[0], later.scene, i), moved[i]), 1e-6);
}

TEST(GltfSkins, MistakesAreReported) {
  const SceneFolder folder;
  GltfBuilder missing = gltf_skin();
  missing.json["skins"][0]["joints"] = {1};
  EXPECT_TRUE(import_at(folder, missing).reported("has a joint that its skin lacks"));
  GltfBuilder outside = gltf_skin();
  outside.json["skins"][0]["joints"] = {1, 9};
  EXPECT_TRUE(import_at(folder, outside).reported("is a node outside the scene"));
  GltfBuilder unweighted = gltf_skin();
  unweighted.json["meshes"][0]["primitives"][0]["attributes"].erase("WEIGHTS_0");
  EXPECT_TRUE(import_at(folder, unweighted).reported("has joints without weights"));
  GltfBuilder few = gltf_skin();
  few.json["accessors"][few.json["skins"][0]["inverseBindMatrices"].get<size_t>()]["count"] = 1;
  EXPECT_TRUE(import_at(folder, few).reported("has fewer inverse bind matrices than joints"));
}

TEST(GltfSkins, NodesShareTheMapsOfASkin) {
  const SceneFolder folder;
  GltfBuilder gltf = gltf_skin();
  gltf.node({{"mesh", 0}, {"skin", 0}});
  const Imported imported = import_at(folder, gltf);
  EXPECT_FALSE(imported.reported("error")) << imported.text();
  EXPECT_EQ(imported.scene.shapes.size(), 2u);
}

TEST(GltfSkins, SetsOfJointsAreLimited) {
  const SceneFolder folder;
  GltfBuilder gltf = gltf_skin();
  Json& attributes = gltf.json["meshes"][0]["primitives"][0]["attributes"];
  for (int set = 1; set < 16; ++set) {
    attributes["JOINTS_" + std::to_string(set)] = attributes["JOINTS_0"];
    attributes["WEIGHTS_" + std::to_string(set)] = attributes["WEIGHTS_0"];
  }
  EXPECT_FALSE(import_at(folder, gltf).reported("error"));
  attributes["JOINTS_16"] = attributes["JOINTS_0"];
  attributes["WEIGHTS_16"] = attributes["WEIGHTS_0"];
  EXPECT_TRUE(import_at(folder, gltf).reported("has more than 16 sets of joints"));
}

/// Every path and interpolation gives what the node's rest state and other interpolations do not.
TEST(GltfNodes, EveryKindOfAnimationIsEvaluated) {
  struct Case {
    const char *path, *interpolation;
    std::vector<float> values; ///< of the keys 1 s and 3 s
    std::vector<DVec3> corners;
  };
  constexpr float kHalf = 0.70710678f;
  const std::vector<Case> cases = {
      {"translation", "LINEAR", {0, 0, 0, 0, 4, 0}, {{0, 1, 0}, {-1, 1, 0}, {0, 2, 0}}},
      {"translation", "STEP", {0, 8, 0, 0, 4, 0}, {{0, 8, 0}, {-1, 8, 0}, {0, 9, 0}}},
      // in-tangent, value, out-tangent; at 1/4 of 2 s: 9/64 * 2 s * 16 + 5/32 * 4 + 3/64 * 2 s * 8
      {"translation",
       "CUBICSPLINE",
       {9, 9, 9, 0, 0, 0, 0, 16, 0, 0, -8, 0, 0, 4, 0, 9, 9, 9},
       {{0, 5.875, 0}, {-1, 5.875, 0}, {0, 6.875, 0}}},
      // a quarter of the way from no turn to one by 120 degrees around z
      {"rotation",
       "LINEAR",
       {0, 0, 0, 1, 0, 0, 0.8660254f, 0.5f},
       {{0, 0, 0}, {-0.8660254, 0.5, 0}, {0.5, 0.8660254, 0}}},
      {"rotation", "STEP", {0, 0, kHalf, kHalf, 0, 0, 0, 1}, {{0, 0, 0}, {0, 1, 0}, {1, 0, 0}}},
      {"scale", "LINEAR", {2, 1, 1, 6, 5, 1}, {{0, 0, 0}, {-3, 0, 0}, {0, 2, 0}}}};
  const SceneFolder folder;
  for (const Case& c : cases) {
    GltfBuilder gltf = gltf_triangle({{c.path, c.path == std::string("rotation") ? Json{1, 0, 0, 0} : Json{7, 7, 7}}});
    add_animation(gltf, {{0, c.path, c.interpolation, {1, 3}, c.values}});
    const Imported imported = import_at(folder, gltf, 1.5);
    EXPECT_EQ(imported.diagnostics.size(), 1u) << imported.text(); // the note of the track
    ASSERT_EQ(imported.scene.instances.size(), 1u);
    for (size_t i = 0; i < 3; ++i) {
      const DVec3 p = transform_point(DAffine(imported.scene.instances[0].world_from_object),
                                      placed(imported.scene.objects[0].shapes[0], imported.scene, i));
      EXPECT_LT(glm::distance(p, c.corners[i]), 1e-6)
          << c.path << " " << c.interpolation << ": " << p.x << " " << p.y << " " << p.z;
    }
  }
}

TEST(GltfMorphs, WeightsMustMatchTheTargets) {
  const SceneFolder folder;
  for (const size_t count : {1, 2, 3}) {
    GltfBuilder gltf;
    const size_t positions = gltf.positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
    const Json target = {{"POSITION", gltf.positions({0, 0, 1, 0, 0, 0, 0, 0, 0})}};
    gltf.mesh({{"attributes", {{"POSITION", positions}}}, {"targets", {target, target}}});
    gltf.node({{"mesh", 0}, {"weights", std::vector<int>(count, 1)}});
    const Imported imported = import_at(folder, gltf);
    EXPECT_EQ(imported.reported("has 2 morph targets, but " + std::to_string(count) + " weights"), count != 2);
    EXPECT_EQ(imported.scene.shapes.size(), count == 2 ? 1u : 0u);
  }
}

TEST(GltfMorphs, WeightsAreAnimated) {
  GltfBuilder gltf;
  const size_t positions = gltf.positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
  Json targets;
  for (float z = 1.0f; z <= 4.0f; z += 1.0f) // four targets: not a rotation
    targets.push_back({{"POSITION", gltf.positions({0, 0, z, 0, 0, 0, 0, 0, 0})}});
  gltf.mesh({{"attributes", {{"POSITION", positions}}}, {"targets", targets}});
  gltf.json["meshes"][0]["weights"] = {1, 0, 0, 0};
  gltf.node({{"mesh", 0}});
  gltf.node({{"mesh", 0}, {"weights", {0, 0, 0, 2}}});
  gltf.node({{"mesh", 0}});
  add_animation(gltf, {{2, "weights", "LINEAR", {0, 1}, {0, 0, 0, 0, 2, 0, 4, 0}}});
  const SceneFolder folder;
  const Imported imported = import_at(folder, gltf, 0.5);
  ASSERT_EQ(imported.scene.shapes.size(), 3u);
  EXPECT_FLOAT_EQ(static_cast<float>(placed(imported.scene.shapes[0], imported.scene, 0).z), 1.0f); // the mesh's
  EXPECT_FLOAT_EQ(static_cast<float>(placed(imported.scene.shapes[1], imported.scene, 0).z), 8.0f); // the node's
  EXPECT_FLOAT_EQ(static_cast<float>(placed(imported.scene.shapes[2], imported.scene, 0).z), 1.0f + 6.0f);
}

/// A lossless WebP image of 2 x 1 pixels: red and opaque, blue and transparent.
std::string webp_image() {
  const uint8_t pixels[] = {255, 0, 0, 255, 0, 0, 255, 0};
  WebPConfig config;
  WebPPicture picture;
  WebPMemoryWriter writer;
  WebPConfigInit(&config);
  WebPPictureInit(&picture);
  WebPMemoryWriterInit(&writer);
  config.lossless = config.exact = 1;
  picture.use_argb = 1;
  picture.width = 2, picture.height = 1;
  picture.writer = WebPMemoryWrite;
  picture.custom_ptr = &writer;
  EXPECT_TRUE(WebPPictureImportRGBA(&picture, pixels, 8) != 0 && WebPEncode(&config, &picture) != 0);
  std::string bytes(reinterpret_cast<const char*>(writer.mem), writer.size);
  WebPMemoryWriterClear(&writer);
  WebPPictureFree(&picture);
  return bytes;
}

GltfBuilder with_material(const Json& material, const std::string& image, const Json& texture) {
  GltfBuilder gltf;
  const size_t positions = gltf.positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
  const size_t uvs = gltf.accessor<float>("VEC2", 5126, {0, 0, 1, 0, 0, 1});
  gltf.json["materials"] = Json::array({material});
  gltf.json["images"] = {{{"bufferView", gltf.view(image)}, {"mimeType", "image/webp"}}};
  gltf.json["textures"] = Json::array({texture});
  gltf.mesh({{"attributes", {{"POSITION", positions}, {"TEXCOORD_0", uvs}}}, {"material", 0}});
  gltf.node({{"mesh", 0}});
  return gltf;
}

TEST(GltfImages, WebpHasColoursAndAlpha) {
  const SceneFolder folder;
  const Json texture = {{"extensions", {{"EXT_texture_webp", {{"source", 0}}}}}};
  GltfBuilder gltf = with_material(
      {{"alphaMode", "MASK"}, {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}, webp_image(), texture);
  gltf.json["extensionsRequired"] = {"EXT_texture_webp"};
  const Imported imported = import_at(folder, gltf);
  EXPECT_EQ(imported.text(), "");
  ASSERT_EQ(imported.scene.textures.size(), 1u);
  EXPECT_EQ(imported.scene.textures[0].rgb, (std::vector<uint8_t>{255, 0, 0, 0, 0, 255}));
  ASSERT_EQ(imported.scene.masks.size(), 1u);
  EXPECT_EQ(imported.scene.masks[0].words[0], 1u);
  EXPECT_LT(glm::distance(only_material(imported).albedo, Vec3(0.5f, 0.0f, 0.5f)), 1e-5f);
}

TEST(GltfImages, EveryPrefixAndFlippedByteOfWebpEndsWell) {
  const SceneFolder folder;
  const std::string good = webp_image();
  const Json texture = {{"extensions", {{"EXT_texture_webp", {{"source", 0}}}}}};
  const Json material = {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}};
  for (size_t size = 1; size < good.size(); ++size)
    EXPECT_EQ(import_at(folder, with_material(material, good.substr(0, size), texture)).scene.shapes.size(), 1u)
        << size;
  for (size_t i = 0; i < good.size(); ++i) {
    std::string bad = good;
    bad[i] = static_cast<char>(bad[i] ^ 0x55);
    import_at(folder, with_material(material, bad, texture));
  }
}

TEST(GltfMaterials, NamesAreUnique) {
  const SceneFolder folder;
  GltfBuilder gltf;
  const size_t positions = gltf.positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
  const auto material = [](const char* name, double red) {
    return Json{{"name", name}, {"pbrMetallicRoughness", {{"baseColorFactor", {red, 0, 0, 1}}}}};
  };
  gltf.json["materials"] = {material("a (2)", 0.2), material("a", 0.4), material("a", 0.6)};
  Json primitives;
  for (int i = 0; i < 3; ++i) primitives.push_back({{"attributes", {{"POSITION", positions}}}, {"material", i}});
  gltf.mesh(primitives[0]);
  gltf.json["meshes"][0]["primitives"] = primitives;
  gltf.node({{"mesh", 0}});
  const Imported imported = import_at(folder, gltf);
  EXPECT_EQ(imported.text(), "");
  std::set<std::string> names;
  std::set<float> reds;
  for (const Material& m : imported.scene.materials) names.insert(m.name), reds.insert(m.albedo.x);
  for (const char* name : {"a", "a (2)", "a (2) (2)"}) EXPECT_TRUE(names.contains(name)) << name;
  for (const float red : {0.2f, 0.4f, 0.6f}) EXPECT_TRUE(reds.contains(red)) << red;
}

/// An image, or a buffer that is too short, is read once, whatever uses it.
TEST(GltfImages, FilesAreReadOnce) {
  const SceneFolder folder;
  folder.write("m.webp", webp_image());
  folder.write("short.bin", "abc");
  GltfBuilder gltf;
  const size_t positions = gltf.positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
  const Json material = {{"pbrMetallicRoughness", {{"metallicRoughnessTexture", {{"index", 0}}}}}};
  for (int i = 0; i < 5; ++i) gltf.json["materials"].push_back(material);
  gltf.json["images"] = {{{"uri", "m.webp"}}};
  gltf.json["textures"] = {{{"source", 0}}};
  gltf.mesh({{"attributes", {{"POSITION", positions}}}, {"material", 4}});
  gltf.node({{"mesh", 0}});
  const uint64_t files = import_at(folder, gltf).statistics.files_read;
  gltf.json["materials"] = Json::array({material});
  gltf.json["meshes"][0]["primitives"][0]["material"] = 0;
  EXPECT_EQ(import_at(folder, gltf).statistics.files_read, files);

  Json text = Json::parse(gltf.text());
  text["buffers"][0] = {{"byteLength", 36}, {"uri", "short.bin"}};
  Json& primitives = text["meshes"][0]["primitives"];
  for (int i = 0; i < 4; ++i) primitives.push_back(primitives[0]);
  const Imported many = import_file(folder.write("b.gltf", text.dump()));
  EXPECT_TRUE(many.reported("claims 36 bytes, but has 3"));
  primitives = Json::array({primitives[0]});
  EXPECT_EQ(import_file(folder.write("b.gltf", text.dump())).statistics.files_read, many.statistics.files_read);
}

/// Many materials with one image of a data URI do not take its memory many times.
TEST(GltfImages, DataUrisAreDecodedOnce) {
  const SceneFolder folder;
  std::string image(webp_image());
  image.resize(size_t{100} << 10, '\0');
  GltfBuilder gltf;
  const size_t positions = gltf.positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
  const Json material = {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}};
  for (int i = 0; i < 300; ++i) gltf.json["materials"].push_back(material);
  gltf.json["images"] = {{{"uri", "data:image/webp;base64," + GltfBuilder::base64(image)}}};
  gltf.json["textures"] = {{{"source", 0}}};
  gltf.mesh({{"attributes", {{"POSITION", positions}}}, {"material", 299}});
  gltf.node({{"mesh", 0}});
  ImportOptions options;
  options.memory = MemoryBudget(20u << 20);
  EXPECT_EQ(import_file(folder.write("a.gltf", gltf.text()), options).text(), "");
}

TEST(GltfImages, MetalnessIsReducedToItsMean) {
  const SceneFolder folder;
  // Blue is metalness: half of the texels.
  const Json material = {{"pbrMetallicRoughness", {{"metallicRoughnessTexture", {{"index", 0}}}}}};
  const Imported half = import_at(folder, with_material(material, webp_image(), {{"source", 0}}));
  EXPECT_TRUE(half.reported("reduced to their means")) << half.text();
  EXPECT_EQ(only_material(half).flags & kMetal, kMetal);
  Json weak = material;
  weak["pbrMetallicRoughness"]["metallicFactor"] = 0.9;
  EXPECT_EQ(only_material(import_at(folder, with_material(weak, webp_image(), {{"source", 0}}))).flags & kMetal, 0u);
}

} // namespace
} // namespace packtrace
