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
#include "tests/pbrt_import/gltf_documents.h"

namespace packtrace {
namespace {

using Json = nlohmann::json;

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
    options.keep_textures = options.keep_shading = true;
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
  const Json dark = {{"emissiveFactor", {1, 1, 1}}, {"emissiveTexture", {{"index", 0}}}};
  const Imported glow = material(dark); // of the linear means of 128 and 64, of 255
  EXPECT_NEAR(only_material(glow).shading.emission.x, 0.5f * (0.21586f + 0.05127f), 1e-4f) << glow.text();
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

/// Imports a triangle below `node` and returns the number of objects; `stated`: the mesh states its lattice.
size_t objects_on_lattice(const SceneFolder& folder, const Json& node, bool stated = true) {
  GltfBuilder gltf = gltf_triangle(node);
  if (stated) gltf.json["meshes"][0]["extras"] = {{"packtrace_lattice", {8, -4}}}; // steps of 1/2
  return import_gltf(folder, gltf).scene.objects.size();
}

TEST(GltfNodes, MeshesStayOnTheLatticeThatTheyState) {
  const SceneFolder folder;
  const Json turned = {{"rotation", {0, 0.6, 0, 0.8}}};
  EXPECT_EQ(objects_on_lattice(folder, turned), 1u);
  EXPECT_EQ(objects_on_lattice(folder, turned, false), 0u);
  EXPECT_EQ(objects_on_lattice(folder, {{"scale", {1, 2, 1}}}), 1u);
  EXPECT_EQ(objects_on_lattice(folder, {{"translation", {0.25, 0, 0}}}), 1u);
  // The import mirrors x, so a scale of -1 in x gives the identity. Exports write such a root node.
  EXPECT_EQ(objects_on_lattice(folder, {{"scale", {-1, 1, 1}}}), 0u);
  EXPECT_EQ(objects_on_lattice(folder, {{"scale", {-2, 2, 2}}, {"translation", {3, 0, -1}}}), 0u);
}

TEST(GltfMaterials, IndexAndFactorGiveTheReflectance) {
  const SceneFolder folder;
  uint64_t problems = 0;
  const auto index_of = [&](const Json& extensions) {
    GltfBuilder gltf;
    gltf.json["materials"] = {{{"extensions", extensions}, {"pbrMetallicRoughness", {{"metallicFactor", 0.0}}}}};
    const Json primitive = {{"attributes", {{"POSITION", gltf.positions({0, 0, 0, 1, 0, 0, 0, 1, 0})}}},
                            {"material", 0}};
    ImportOptions options;
    options.keep_shading = true;
    const Imported imported = import_gltf(folder, with_primitive(primitive, gltf), options);
    problems = imported.reported("not within 1 and 1000; it counts as 1.5");
    return only_material(imported).shading.eta;
  };
  EXPECT_FLOAT_EQ(index_of(Json::object()), 1.5f);
  EXPECT_FLOAT_EQ(index_of({{"KHR_materials_ior", {{"ior", 2.0}}}}), 2.0f);
  // A quarter of the reflectance of 1/9, which is that of (1 + 1/6) / (1 - 1/6).
  EXPECT_FLOAT_EQ(
      index_of({{"KHR_materials_ior", {{"ior", 2.0}}}, {"KHR_materials_specular", {{"specularFactor", 0.25}}}}), 1.4f);
  EXPECT_FLOAT_EQ(index_of({{"KHR_materials_specular", {{"specularFactor", 0.0}}}}), 1.0f);
  EXPECT_EQ(problems, 0u);
  for (const double wrong : {0.0, 0.5, -1.0, 1e30}) {
    EXPECT_FLOAT_EQ(index_of({{"KHR_materials_ior", {{"ior", wrong}}}}), 1.5f);
    EXPECT_EQ(problems, 1u) << wrong;
  }
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

} // namespace
} // namespace packtrace
