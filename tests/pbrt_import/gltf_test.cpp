// Imports of glTF files.

#include <filesystem>
#include <numbers>
#include <random>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#pragma GCC diagnostic pop
#include <meshoptimizer.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/scene_format.h"
#include "tests/pbrt_import/damaged_files.h"
#include "tests/pbrt_import/gltf_builder.h"
#include "tests/pbrt_import/scene_folder.h"

namespace packtrace {
namespace {

using Json = nlohmann::json;

const std::vector<float> kSquare = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};

Imported import_gltf(const SceneFolder& folder, const GltfBuilder& gltf, const ImportOptions& options = {}) {
  Imported text = import_file(folder.write("a.gltf", gltf.text()), options);
  const Imported binary = import_file(folder.write("a.glb", gltf.binary()), options);
  EXPECT_EQ(text.scene.shapes.size(), binary.scene.shapes.size());
  EXPECT_EQ(placed_triangle_count(text.scene), placed_triangle_count(binary.scene));
  return text;
}

/// A document with one mesh in one node.
GltfBuilder with_primitive(const Json& primitive, GltfBuilder gltf, const Json& node = Json::object()) {
  const size_t mesh = gltf.mesh(primitive);
  Json whole = node;
  whole["mesh"] = mesh;
  gltf.node(whole);
  return gltf;
}

const Mesh& only_mesh(const Imported& imported) {
  static const Mesh kNone;
  EXPECT_EQ(imported.scene.meshes.size(), 1u) << imported.text();
  return imported.scene.meshes.empty() ? kNone : imported.scene.meshes[0];
}

TEST(GltfPrimitives, IndicesOfEveryTypeAndNone) {
  const SceneFolder folder;
  for (int kind = 0; kind < 4; ++kind) {
    GltfBuilder gltf;
    Json primitive = {{"attributes", {{"POSITION", gltf.positions(kSquare)}}}};
    if (kind == 0) primitive["indices"] = gltf.accessor<uint8_t>("SCALAR", 5121, {0, 1, 2, 0, 2, 3});
    if (kind == 1) primitive["indices"] = gltf.accessor<uint16_t>("SCALAR", 5123, {0, 1, 2, 0, 2, 3});
    if (kind == 2) primitive["indices"] = gltf.accessor<uint32_t>("SCALAR", 5125, {0, 1, 2, 0, 2, 3});
    if (kind == 3)
      primitive["attributes"]["POSITION"] = gltf.positions({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0, 1, 1, 0, 0, 1, 0});
    const Imported imported = import_gltf(folder, with_primitive(primitive, gltf));
    EXPECT_EQ(imported.text(), "");
    EXPECT_EQ(only_mesh(imported).triangles.size(), 2u);
  }
}

TEST(GltfPrimitives, StripsAndFansKeepTheirOrientation) {
  const SceneFolder folder;
  for (const int mode : {4, 5, 6}) {
    GltfBuilder gltf;
    const std::vector<uint16_t> indices = mode == 4   ? std::vector<uint16_t>{0, 1, 2, 0, 2, 3}
                                          : mode == 5 ? std::vector<uint16_t>{1, 2, 0, 3, 3}
                                                      : std::vector<uint16_t>{0, 1, 2, 3};
    const Json primitive = {{"attributes", {{"POSITION", gltf.positions(kSquare)}}},
                            {"mode", mode},
                            {"indices", gltf.accessor("SCALAR", 5123, indices)}};
    const Imported imported = import_gltf(folder, with_primitive(primitive, gltf));
    EXPECT_EQ(imported.text(), "");
    const Mesh& mesh = only_mesh(imported);
    ASSERT_EQ(mesh.triangles.size(), 2u);
    for (const Triangle& t : mesh.triangles)
      EXPECT_GT(glm::cross(mesh.positions[t[1]] - mesh.positions[t[0]], mesh.positions[t[2]] - mesh.positions[t[0]]).z,
                0.0f)
          << mode;
  }
}

TEST(GltfAccessors, InterleavedNormalizedAndSparse) {
  const SceneFolder folder;
  GltfBuilder gltf;
  // Three positions of 16-bit fractions with normals of 8 bits, 12 bytes per vertex.
  struct Vertex {
    uint16_t position[3];
    int8_t normal[3];
    uint8_t padding[3];
  };
  const std::vector<Vertex> vertices = {
      {{0, 0, 0}, {0, 0, 127}, {}}, {{65535, 0, 0}, {0, 0, 127}, {}}, {{0, 65535, 0}, {0, 0, -128}, {}}};
  const size_t view = gltf.view(vertices);
  gltf.json["bufferViews"][view]["byteStride"] = sizeof(Vertex);
  gltf.json["extensionsRequired"] = {"KHR_mesh_quantization"};
  const size_t position =
      gltf.accessor({{"bufferView", view},
                     {"componentType", 5123},
                     {"normalized", true},
                     {"type", "VEC3"},
                     {"count", 3},
                     {"sparse",
                      {{"count", 1},
                       {"indices", {{"bufferView", gltf.view(std::vector<uint8_t>{1})}, {"componentType", 5121}}},
                       {"values", {{"bufferView", gltf.view(std::vector<uint16_t>{0, 0, 65535})}}}}}});
  const size_t normal = gltf.accessor({{"bufferView", view},
                                       {"byteOffset", 6},
                                       {"componentType", 5120},
                                       {"normalized", true},
                                       {"type", "VEC3"},
                                       {"count", 3}});
  const Imported imported =
      import_gltf(folder, with_primitive({{"attributes", {{"POSITION", position}, {"NORMAL", normal}}}}, gltf));
  EXPECT_EQ(imported.text(), "");
  const Mesh& mesh = only_mesh(imported);
  EXPECT_EQ(mesh.positions, (std::vector<Vec3>{{0, 0, 0}, {0, 0, 1}, {0, 1, 0}}));
  EXPECT_EQ(mesh.normals[2], Vec3(0, 0, -1));
}

TEST(GltfNodes, HierarchiesInstancesAndCameras) {
  const SceneFolder folder;
  GltfBuilder gltf;
  const size_t mesh = gltf.mesh({{"attributes", {{"POSITION", gltf.positions({0, 0, 0, 1, 0, 0, 0, 1, 0})}}}});
  const double half = std::sqrt(0.5);
  gltf.node({{"translation", {10, 0, 0}}, {"children", {1}}});
  gltf.json["nodes"].push_back({{"rotation", {0, half, 0, half}}, {"scale", {2, 2, 2}}, {"mesh", mesh}});
  gltf.node({{"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 5, 0, 1}}, {"mesh", mesh}});
  gltf.node({{"mesh", mesh},
             {"extensions",
              {{"EXT_mesh_gpu_instancing", {{"attributes", {{"TRANSLATION", gltf.positions({0, 0, 1, 0, 0, 2})}}}}}}}});
  gltf.json["cameras"] = {{{"type", "perspective"},
                           {"perspective", {{"yfov", std::numbers::pi / 3}, {"aspectRatio", 2.0}, {"znear", 0.1}}}}};
  gltf.node({{"translation", {0, 0, 7}}, {"camera", 0}});
  const Imported imported = import_gltf(folder, gltf);
  EXPECT_EQ(imported.text(), "");
  ASSERT_EQ(imported.scene.instances.size(), 4u);
  EXPECT_EQ(imported.scene.objects.size(), 1u);
  const auto at = [&](size_t i, Vec3 p) { return transform_point(imported.scene.instances[i].world_from_object, p); };
  EXPECT_LT(glm::length(at(0, {1, 0, 0}) - Vec3(-10, 0, -2)), 1e-6f); // x is mirrored
  EXPECT_LT(glm::length(at(1, {1, 0, 0}) - Vec3(-1, 5, 0)), 1e-6f);
  EXPECT_LT(glm::length(at(3, {0, 0, 0}) - Vec3(0, 0, 2)), 1e-6f);
  ASSERT_EQ(imported.scene.cameras.size(), 1u);
  const Camera& camera = imported.scene.cameras[0];
  EXPECT_NEAR(camera.fov_degrees, 60.0, 1e-4);
  EXPECT_EQ(camera.width_px, 1440u);
  EXPECT_LT(glm::length(camera.world_from_camera[3] - DVec3(0, 0, 7)), 1e-9);
  EXPECT_LT(glm::length(camera.world_from_camera[2] - DVec3(0, 0, -1)), 1e-9); // looks along -z
  EXPECT_LT(glm::length(camera.world_from_camera[0] - DVec3(-1, 0, 0)), 1e-9); // its right in mirrored coordinates
}

TEST(GltfNodes, AnimationsAreEvaluatedAtATime) {
  const SceneFolder folder;
  GltfBuilder gltf = with_primitive({{"attributes", {{"POSITION", 0}}}}, [] {
    GltfBuilder g;
    g.positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
    return g;
  }());
  const size_t times = gltf.accessor<float>("SCALAR", 5126, {1, 3}), places = gltf.positions({0, 0, 0, 0, 4, 0});
  gltf.json["animations"] = {{{"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}}}},
                              {"samplers", {{{"input", times}, {"output", places}}}}}};
  for (const auto& [time, y] : {std::pair{0.0, 0.0}, {2.0, 2.0}, {2.5, 3.0}, {9.0, 4.0}}) {
    ImportOptions options;
    options.time = time;
    const Imported imported = import_gltf(folder, gltf, options);
    EXPECT_EQ(imported.text(), "");
    EXPECT_DOUBLE_EQ(placed(imported.scene.shapes.at(0), imported.scene, 0).y, y);
  }
}

TEST(GltfNodes, CyclesAndSeveralParentsAreReported) {
  const SceneFolder folder;
  GltfBuilder gltf = with_primitive({{"attributes", {{"POSITION", 0}}}}, [] {
    GltfBuilder g;
    g.positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
    return g;
  }());
  gltf.node({{"children", {0, 1, 77}}});
  const Imported imported = import_gltf(folder, gltf);
  EXPECT_TRUE(imported.reported("nodes[0] has several parents")) << imported.text();
  EXPECT_TRUE(imported.reported("nodes[1] has several parents")) << imported.text();
  EXPECT_TRUE(imported.reported("no element 77")) << imported.text();
  EXPECT_EQ(unique_triangle_count(imported.scene), 1u);
}

TEST(GltfMaterials, ColoursMasksAndLight) {
  const SceneFolder folder;
  const auto material = [&](const Json& description) {
    GltfBuilder gltf;
    gltf.json["materials"] = Json::array({description});
    const Json primitive = {{"attributes",
                             {{"POSITION", gltf.positions({0, 0, 0, 1, 0, 0, 0, 1, 0})},
                              {"TEXCOORD_0", gltf.accessor<float>("VEC2", 5126, {0, 0, 1, 0, 0, 1})}}},
                            {"material", 0}};
    gltf.json["images"] = {{{"bufferView", gltf.view(good_png())}, {"mimeType", "image/png"}}};
    gltf.json["textures"] = {{{"source", 0}}};
    ImportOptions options;
    options.keep_textures = true;
    return import_gltf(folder, with_primitive(primitive, gltf), options);
  };
  const auto only = [&](const Json& description) {
    const Imported imported = material(description);
    EXPECT_EQ(imported.text(), "");
    return only_material(imported);
  };
  EXPECT_EQ(only({{"pbrMetallicRoughness", {{"baseColorFactor", {0.25, 0.5, 0.75, 1}}, {"metallicFactor", 0}}}}).albedo,
            Vec3(0.25f, 0.5f, 0.75f));
  EXPECT_EQ(only(Json::object()).flags, kMetal); // the default of metallicFactor is 1
  EXPECT_EQ(only({{"emissiveFactor", {1, 1, 1}}, {"extensions", {{"KHR_materials_unlit", Json::object()}}}}).flags,
            kEmissive);
  EXPECT_EQ(only({{"extensions", {{"KHR_materials_transmission", {{"transmissionFactor", 1}}}}}}).flags, kTransmissive);
  const Imported textured =
      material({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}, {"metallicFactor", 0}}}});
  EXPECT_EQ(textured.text(), "");
  EXPECT_EQ(only_material(textured).flags, kAlbedoTexture);
  const Mesh& mesh = only_mesh(textured);
  EXPECT_EQ(mesh.uvs[0], Vec2(0.0f, 1.0f)); // v points upwards
  const Imported absent =
      material({{"alphaMode", "MASK"}, {"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1, 0.25}}}}});
  EXPECT_EQ(absent.scene.shapes.size(), 0u);
  EXPECT_EQ(absent.statistics.shapes_absent, 1u);
}

/// A square whose buffer views are compressed by EXT_meshopt_compression.
GltfBuilder meshopt_square() {
  GltfBuilder gltf;
  const std::vector<uint32_t> indices = {0, 1, 2, 0, 2, 3};
  std::vector<unsigned char> vertices(meshopt_encodeVertexBufferBound(4, 12)),
      triangles(meshopt_encodeIndexBufferBound(6, 4));
  vertices.resize(meshopt_encodeVertexBuffer(vertices.data(), vertices.size(), kSquare.data(), 4, 12));
  triangles.resize(meshopt_encodeIndexBuffer(triangles.data(), triangles.size(), indices.data(), 6));
  const auto compressed = [&](const std::vector<unsigned char>& data, const char* mode, size_t count, size_t stride) {
    const size_t view = gltf.view(data);
    Json& described = gltf.json["bufferViews"][view];
    Json extension = described;
    extension["mode"] = mode, extension["count"] = count, extension["byteStride"] = stride;
    described["byteLength"] = count * stride;
    described["extensions"]["EXT_meshopt_compression"] = extension;
    return view;
  };
  const size_t position = gltf.accessor({{"bufferView", compressed(vertices, "ATTRIBUTES", 4, 12)},
                                         {"componentType", 5126},
                                         {"type", "VEC3"},
                                         {"count", 4}});
  const size_t index = gltf.accessor({{"bufferView", compressed(triangles, "TRIANGLES", 6, 4)},
                                      {"componentType", 5125},
                                      {"type", "SCALAR"},
                                      {"count", 6}});
  return with_primitive({{"attributes", {{"POSITION", position}}}, {"indices", index}}, gltf);
}

/// A square compressed by Draco, in buffer view 0.
GltfBuilder draco_square() {
  draco::TriangleSoupMeshBuilder soup;
  soup.Start(2);
  const int position = soup.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  const float a[] = {0, 0, 0}, b[] = {1, 0, 0}, c[] = {1, 1, 0}, d[] = {0, 1, 0};
  soup.SetAttributeValuesForFace(position, draco::FaceIndex(0), a, b, c);
  soup.SetAttributeValuesForFace(position, draco::FaceIndex(1), a, c, d);
  const auto mesh = soup.Finalize();
  draco::EncoderBuffer buffer;
  EXPECT_TRUE(draco::Encoder().EncodeMeshToBuffer(*mesh, &buffer).ok());
  GltfBuilder gltf;
  const size_t view = gltf.view(std::string_view(buffer.data(), buffer.size()));
  const Json primitive = {
      {"attributes", {{"POSITION", gltf.accessor({{"componentType", 5126}, {"type", "VEC3"}, {"count", 4}})}}},
      {"extensions", {{"KHR_draco_mesh_compression", {{"bufferView", view}, {"attributes", {{"POSITION", 0}}}}}}}};
  return with_primitive(primitive, gltf);
}

TEST(GltfCompression, MeshoptViewsAreDecoded) {
  const SceneFolder folder;
  const GltfBuilder whole = meshopt_square();
  const Imported imported = import_gltf(folder, whole);
  EXPECT_EQ(imported.text(), "");
  EXPECT_EQ(only_mesh(imported).triangles.size(), 2u);
  GltfBuilder damaged = whole;
  damaged.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]["byteLength"] = 5;
  EXPECT_TRUE(
      import_gltf(folder, damaged).reported("bufferViews[0].extensions.EXT_meshopt_compression has damaged data"));
}

TEST(GltfCompression, DracoPrimitivesAreDecoded) {
  const SceneFolder folder;
  GltfBuilder gltf = draco_square();
  const Imported imported = import_gltf(folder, gltf);
  EXPECT_EQ(imported.text(), "");
  EXPECT_EQ(only_mesh(imported).triangles.size(), 2u);
  Json& view = gltf.json["bufferViews"][0];
  view["byteLength"] = view["byteLength"].get<size_t>() / 2;
  EXPECT_TRUE(import_gltf(folder, gltf).reported("KHR_draco_mesh_compression has damaged Draco data"));
}

/// Every bit of compressed buffers, and pairs of bytes, may be wrong.
TEST(GltfCompression, MutatedBuffersEndWell) {
  const SceneFolder folder;
  ImportOptions options;
  options.memory = MemoryBudget(64u << 20);
  size_t imported = 0, refused = 0;
  const auto try_file = [&](const std::string& content) {
    try {
      const Imported result = import_file(folder.write("a.glb", content), options);
      ++(result.text().empty() ? imported : refused);
    } catch (const Error& error) {
      ++refused;
      EXPECT_TRUE(error.kind() == ErrorKind::kInput || error.kind() == ErrorKind::kUnsupported) << error.what();
    }
  };
  for (const GltfBuilder& gltf : {meshopt_square(), draco_square()}) {
    const std::string whole = gltf.binary();
    const size_t buffer = whole.find("BIN") + 4; // behind the name of the chunk
    ASSERT_LT(buffer, whole.size());
    std::minstd_rand random(1);
    for (size_t i = buffer; i < whole.size(); ++i)
      for (int change = 0; change < 12; ++change) {
        std::string mutated = whole;
        if (change < 8) {
          mutated[i] = static_cast<char>(mutated[i] ^ (1 << change));
        } else {
          mutated[i] = static_cast<char>(random());
          mutated[buffer + random() % (whole.size() - buffer)] = static_cast<char>(random());
        }
        try_file(mutated);
      }
  }
  EXPECT_GT(imported, 0u);
  EXPECT_GT(refused, 0u);
}

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
