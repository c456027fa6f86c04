// What glTF files may not do: malformed documents, files outside their folder, memory.

#include <filesystem>

#include "pbrt_import/base/error.h"
#include "tests/pbrt_import/damaged_files.h"
#include "tests/pbrt_import/gltf_documents.h"

namespace packtrace {
namespace {

using Json = nlohmann::json;

TEST(GltfProblems, AreNamedByTheirPath) {
  const SceneFolder folder;
  const auto problem = [&](const auto& change) {
    GltfBuilder gltf;
    const Json primitive = {{"attributes", {{"POSITION", gltf.positions(kSquare)}}},
                            {"indices", gltf.accessor<uint16_t>("SCALAR", 5123, {0, 1, 2})}};
    gltf = with_primitive(primitive, gltf);
    change(gltf.json);
    return import_gltf(folder, gltf).text();
  };
  const auto expect = [&](const std::string& expected, const auto& change) {
    const std::string text = problem(change);
    EXPECT_NE(text.find(expected), std::string::npos) << expected << "\n" << text;
  };
  expect("accessors[0] lies outside its buffer view", [](Json& j) { j["accessors"][0]["count"] = 5; });
  expect("accessors[0].count is not a whole number", [](Json& j) { j["accessors"][0]["count"] = -5; });
  expect("bufferViews[0] lies outside its buffer", [](Json& j) { j["bufferViews"][0]["byteLength"] = 1e9; });
  expect("bufferViews[0] has a byteStride", [](Json& j) { j["bufferViews"][0]["byteStride"] = 4; });
  expect("meshes[0].primitives[0] has an index out of range", [](Json& j) { j["accessors"][0]["count"] = 2; });
  expect("accessors has 2 elements, no element 9", [](Json& j) { j["meshes"][0]["primitives"][0]["indices"] = 9; });
  expect("has a POSITION of the wrong type", [](Json& j) { j["accessors"][0]["type"] = "VEC2"; });
  expect("meshes[0].primitives is not an array", [](Json& j) { j["meshes"][0]["primitives"] = 1; });
  expect("materials has no element 3", [](Json& j) { j["meshes"][0]["primitives"][0]["material"] = 3; });
  expect("points and lines have no surface", [](Json& j) { j["meshes"][0]["primitives"][0]["mode"] = 1; });
}

TEST(GltfProblems, WhatIsLeftOutIsCountedAndSaidOnce) {
  const SceneFolder folder;
  GltfBuilder gltf;
  const Json texture = {{"index", 0}}, kNothing = Json::object();
  const Json material = {
      {"normalTexture", texture},
      {"occlusionTexture", texture},
      {"emissiveTexture", texture},
      {"emissiveFactor", {1, 1, 1}},
      {"alphaMode", "BLEND"},
      {"pbrMetallicRoughness", {{"baseColorTexture", texture}, {"metallicRoughnessTexture", texture}}},
      {"extensions",
       {{"KHR_materials_clearcoat", kNothing},
        {"KHR_materials_specular", {{"specularTexture", texture}}},
        {"KHR_materials_transmission", {{"transmissionFactor", 0.1}, {"transmissionTexture", texture}}}}}};
  gltf.json["materials"] = {material, material};
  gltf.json["extensionsUsed"] = {"KHR_materials_clearcoat", "EXT_unheard_of"};
  gltf.json["images"] = {{{"bufferView", gltf.view(good_png())}, {"mimeType", "image/png"}, {"name", "bricks"}}};
  gltf.json["textures"] = {{{"source", 0}}};
  const Json primitive = {{"attributes",
                           {{"POSITION", gltf.positions({0, 0, 0, 1, 0, 0, 0, 1, 0})},
                            {"COLOR_0", gltf.positions({1, 0, 0, 0, 1, 0, 0, 0, 1})}}},
                          {"material", 0}};
  const Imported imported = import_gltf(folder, with_primitive(primitive, gltf));
  for (const char* const expected :
       {"warning: the extension \"EXT_unheard_of\" is left out", "warning: normal maps are left out",
        "warning: textures of occlusion are left out", "warning: textures of emission are reduced to their means",
        "warning: blending is reduced", "warning: KHR_materials_clearcoat is left out",
        "warning: KHR_materials_specular is reduced to its factor", "warning: textures of transmission are left out",
        "warning: textures of metalness and roughness are reduced", "warning: colours of vertices are left out",
        "note: names of images in the file are left out"})
    EXPECT_TRUE(imported.reported(expected)) << expected << "\n" << imported.text();
  EXPECT_TRUE(imported.reported("normal maps are left out: surfaces keep the normals of their vertices (2 times"))
      << imported.text();
  ASSERT_EQ(imported.scene.materials.size(), 1u);
  EXPECT_EQ(imported.scene.materials[0].flags & (kNormalMap | kEmissive), kNormalMap | kEmissive);
}

TEST(GltfProblems, EndTheImportWhereNothingIsLeft) {
  const SceneFolder folder;
  const auto fails = [&](const std::string& text, ErrorKind kind, const std::string& expected) {
    try {
      import_file(folder.write("a.gltf", text));
      FAIL() << expected;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), kind) << error.what();
      EXPECT_NE(std::string(error.what()).find(expected), std::string::npos) << error.what();
    }
  };
  fails("{\n \"asset\": {,}\n}", ErrorKind::kInput, "a.gltf:2:12: malformed JSON");
  fails("{\"asset\": {\"version\": 1e400}}", ErrorKind::kInput, "a number in the JSON text is too large");
  fails("[]", ErrorKind::kInput, "a.gltf: the JSON text is not an object");
  fails("{}", ErrorKind::kInput, "a.gltf: the document lacks asset");
  fails(R"({"asset": {"version": "1.0"}})", ErrorKind::kUnsupported, "only version 2 is read");
  fails(R"({"asset": {"version": "2.0"}, "extensionsRequired": ["KHR_x"]})", ErrorKind::kUnsupported, "\"KHR_x\"");
  fails("glTF", ErrorKind::kInput, "the file ends inside its header");
}

TEST(GltfProblems, FilesOutsideTheFolderAreRefused) {
  const SceneFolder folder;
  GltfBuilder gltf;
  const Json primitive = {{"attributes", {{"POSITION", gltf.positions(kSquare)}}}};
  Json document = with_primitive(primitive, gltf).json;
  folder.write("data.bin", std::string(48, '\0'));
  const auto import_with = [&](const std::string& uri, bool allow) {
    document["buffers"] = {{{"byteLength", 48}, {"uri", uri}}};
    ImportOptions options;
    options.allow_uris_outside_folder = allow;
    return import_file(folder.write("inner/a.gltf", document.dump()), options);
  };
  EXPECT_TRUE(import_with("../data.bin", false).reported("leads out of the document's folder"));
  EXPECT_TRUE(import_with("https://example.org/data.bin", true).reported("is not a file beside the document"));
  EXPECT_FALSE(import_with("%2e%2e/data.bin", true).reported("leads out"));
  EXPECT_TRUE(import_with("none.bin", false).reported("buffers[0].uri names"));
  const std::string absolute = (folder.path() / "data.bin").string();
  EXPECT_TRUE(import_with(absolute, false).reported("leads out of the document's folder"));
  EXPECT_FALSE(import_with(absolute, true).reported("leads out"));
  std::filesystem::create_symlink(absolute, folder.path() / "inner/link.bin");
  EXPECT_TRUE(import_with("link.bin", false).reported("leads out of the document's folder"));
  EXPECT_FALSE(import_with("link.bin", true).reported("leads out"));
}

/// Images are read by the importer of pbrt files, which reads back-slashes as slashes.
TEST(GltfProblems, ImagesOutsideTheFolderAreRefused) {
  const SceneFolder folder;
  GltfBuilder gltf;
  gltf.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
  gltf.json["textures"] = {{{"source", 0}}};
  const Json primitive = {{"attributes",
                           {{"POSITION", gltf.positions(kSquare)},
                            {"TEXCOORD_0", gltf.accessor<float>("VEC2", 5126, {0, 0, 1, 0, 1, 1, 0, 1})}}},
                          {"indices", gltf.accessor<uint16_t>("SCALAR", 5123, {0, 1, 2, 0, 2, 3})},
                          {"material", 0}};
  GltfBuilder document = with_primitive(primitive, gltf);
  folder.write("secret.png", std::string(good_png()));
  folder.write("inner/images/own.png", std::string(good_png()));
  std::filesystem::create_symlink(folder.path() / "secret.png", folder.path() / "inner/link.png");
  const auto import_with = [&](const std::string& uri, bool allow) {
    document.json["images"] = {{{"uri", uri}}};
    ImportOptions options;
    options.keep_textures = true;
    options.allow_uris_outside_folder = allow;
    return import_file(folder.write("inner/a.gltf", document.text()), options);
  };
  const uint64_t files = import_with("none.png", false).statistics.files_read;
  for (const std::string& uri :
       {std::string("../secret.png"), std::string("..\\secret.png"), std::string("..%5Csecret.png"),
        std::string("%2e%2e%5csecret.png"), std::string("%2e%2e/secret.png"), std::string("images\\..\\..\\secret.png"),
        std::string("link.png"), (folder.path() / "secret.png").string()}) {
    const Imported refused = import_with(uri, false);
    EXPECT_TRUE(refused.reported("leads out of the document's folder")) << uri << "\n" << refused.text();
    EXPECT_EQ(refused.statistics.files_read, files) << uri;
    const Imported allowed = import_with(uri, true);
    EXPECT_FALSE(allowed.reported("leads out")) << uri << "\n" << allowed.text();
    EXPECT_EQ(allowed.statistics.files_read, files + 1) << uri;
  }
  EXPECT_EQ(import_with("images/own.png", false).statistics.files_read, files + 1);
  const Imported windows = import_with("images\\own.png", false);
  EXPECT_EQ(windows.statistics.files_read, files + 1);
  EXPECT_TRUE(windows.reported("back-slashes")) << windows.text();
  folder.write("inner/a\\b.png", std::string(good_png()));
  EXPECT_EQ(import_with("a\\b.png", false).statistics.files_read, files + 1);
  EXPECT_TRUE(import_with("own.png%00", false).reported("has a zero byte"));
}

TEST(GltfProblems, MemoryIsLimited) {
  const SceneFolder folder;
  GltfBuilder gltf;
  const Json primitive = {
      {"attributes",
       {{"POSITION", gltf.accessor({{"componentType", 5126}, {"type", "VEC3"}, {"count", 2'000'000'000}})}}}};
  ImportOptions options;
  options.memory = MemoryBudget(16u << 20);
  EXPECT_THROW(import_file(folder.write("a.gltf", with_primitive(primitive, gltf).text()), options), MemoryError);
}

/// Values are counted until their primitive is made, together with the copies that it takes.
TEST(GltfProblems, MemoryOfAccessorsWithoutViewsIsCounted) {
  const SceneFolder folder;
  GltfBuilder gltf;
  constexpr int kVertices = 300'000; // 3.4 MiB of positions and as much of normals
  const auto zeros = [&] { return gltf.accessor({{"componentType", 5126}, {"type", "VEC3"}, {"count", kVertices}}); };
  const Json primitive = {{"attributes", {{"POSITION", zeros()}, {"NORMAL", zeros()}}},
                          {"indices", gltf.accessor<uint16_t>("SCALAR", 5123, {0, 1, 2})}};
  const std::filesystem::path file = folder.write("a.gltf", with_primitive(primitive, gltf).text());
  ImportOptions options;
  options.memory = MemoryBudget(10u << 20);
  EXPECT_THROW(import_file(file, options), MemoryError);
  options.memory = MemoryBudget(64u << 20);
  EXPECT_NO_THROW(import_file(file, options));
}

TEST(GltfProblems, EveryPrefixAndFlippedByteEndsWell) {
  const SceneFolder folder;
  GltfBuilder gltf;
  gltf.json["materials"] = {{{"alphaMode", "MASK"}, {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
  gltf.json["images"] = {{{"bufferView", gltf.view(good_png())}, {"mimeType", "image/png"}}};
  gltf.json["textures"] = {{{"source", 0}}};
  const Json primitive = {{"attributes", {{"POSITION", gltf.positions(kSquare)}}},
                          {"material", 0},
                          {"indices", gltf.accessor<uint16_t>("SCALAR", 5123, {0, 1, 2})}};
  const std::string whole = with_primitive(primitive, gltf, {{"translation", {1, 2, 3}}}).binary();
  ImportOptions options;
  options.memory = MemoryBudget(16u << 20);
  for (size_t i = 0; i < whole.size(); ++i) {
    std::string flipped = whole;
    flipped[i] = static_cast<char>(flipped[i] ^ (1 << i % 8));
    for (const std::string& content : {whole.substr(0, i), flipped}) {
      try {
        import_file(folder.write("a.glb", content), options);
      } catch (const Error& error) {
        EXPECT_TRUE(error.kind() == ErrorKind::kInput || error.kind() == ErrorKind::kUnsupported) << error.what();
      }
    }
  }
}

} // namespace
} // namespace packtrace
