#include "compress/exchange/gltf/gltf_export.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "pbrt_import/base/error.h"
#include "tests/compress/gltf_test_support.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

using namespace gltf_test;

using Face = std::array<LatticePoint, 3>;

double step_of(const BakedFile& file, uint32_t geometry) {
  const baked::GeometryRecord& record = file.geometries()[geometry];
  return PositionGrid{record.step_mantissa, record.step_exponent}.step();
}

std::multiset<Face> faces_of(const BakedFile& file, uint32_t geometry) {
  std::multiset<Face> faces;
  for (uint32_t c = 0; c < file.clusters(geometry).size(); ++c) {
    const ClusterView view = file.cluster(geometry, c);
    for (uint32_t i = 0; i < view.triangle_count(); ++i) {
      const Triangle t = view.triangle(i);
      faces.insert(test::face_of<LatticePoint>({view.lattice(t.x), view.lattice(t.y), view.lattice(t.z)}));
    }
  }
  return faces;
}

/// Faces of a mesh in lattice coordinates for the given step. Checks that its positions lie on the lattice.
std::multiset<Face> faces_of(const tinygltf::Model& model, const tinygltf::Mesh& mesh, double step) {
  std::multiset<Face> faces;
  for (const tinygltf::Primitive& primitive : mesh.primitives) {
    const Part part = part_of(model, primitive);
    for (const Triangle& t : part.triangles) {
      Face face;
      for (int corner = 0; corner < 3; ++corner)
        for (int axis = 0; axis < 3; ++axis) {
          const double steps = part.positions[t[corner]][axis] / step;
          face[static_cast<size_t>(corner)][static_cast<size_t>(axis)] = std::llround(steps);
          EXPECT_LT(std::abs(steps - std::round(steps)), 0.05);
        }
      faces.insert(test::face_of(face));
    }
  }
  return faces;
}

class GltfCodecs : public testing::TestWithParam<bool> {};

TEST_P(GltfCodecs, EveryTriangleStaysOnTheLattice) {
  const BakedScene baked = test::bake(test::mixed_scene());
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  GltfConfig config;
  config.codec = GetParam() ? GltfCodec::kDraco : GltfCodec::kNone;
  const GltfExport result = export_of(file, config);
  const tinygltf::Model model = parse(result);
  EXPECT_EQ(result.report.collapsed_triangles, 0u);
  ASSERT_EQ(model.nodes.size(), 1 + file.instances().size());
  for (size_t i = 0; i < file.instances().size(); ++i) {
    const uint32_t geometry = file.instances()[i].geometry;
    const tinygltf::Node& node = model.nodes[1 + i];
    const tinygltf::Mesh& mesh = model.meshes[static_cast<size_t>(node.mesh)];
    EXPECT_EQ(faces_of(model, mesh, step_of(file, geometry)), faces_of(file, geometry)) << i;
    for (size_t column = 0; column < 4 && !node.matrix.empty(); ++column)
      for (size_t row = 0; row < 3; ++row)
        EXPECT_EQ(node.matrix[4 * column + row], file.instances()[i].world_from_object[3 * column + row]);
  }
}
INSTANTIATE_TEST_SUITE_P(All, GltfCodecs, testing::Bool());

TEST(GltfExport, NormalsAndTextureCoordinatesAreWithinTheirBits) {
  BakeConfig bake;
  bake.keep_uvs = true;
  const BakedScene baked = test::bake(test::mixed_scene(), bake);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  const tinygltf::Model exact = parse(export_of(file, plain())), coded = parse(export_of(file));
  size_t normals = 0, uvs = 0;
  for (size_t m = 0; m < exact.meshes.size(); ++m)
    for (size_t p = 0; p < exact.meshes[m].primitives.size(); ++p) {
      const Part a = part_of(exact, exact.meshes[m].primitives[p]), b = part_of(coded, coded.meshes[m].primitives[p]);
      // Every Draco vertex must match an exact vertex at its position.
      std::multimap<std::array<float, 3>, size_t> places;
      const auto key = [](Vec3 v) {
        return std::array<float, 3>{std::round(v.x * 1e4f), std::round(v.y * 1e4f), std::round(v.z * 1e4f)};
      };
      for (size_t i = 0; i < a.positions.size(); ++i) places.emplace(key(a.positions[i]), i);
      for (size_t i = 0; i < b.positions.size(); ++i) {
        const auto [first, last] = places.equal_range(key(b.positions[i]));
        if (first == last) continue; // rounded to another cell
        float normal_cosine = -1.0f, uv_distance = 1e9f;
        for (auto at = first; at != last; ++at) {
          if (!b.normals.empty())
            normal_cosine = std::max(normal_cosine, glm::dot(a.normals[at->second], b.normals[i]));
          if (!b.uvs.empty()) uv_distance = std::min(uv_distance, glm::distance(a.uvs[at->second], b.uvs[i]));
        }
        normals += !b.normals.empty(), uvs += !b.uvs.empty();
        if (!b.normals.empty()) {
          EXPECT_GT(normal_cosine, 0.999995f);
        } // 0.04 degrees at 12 bits, plus rounding
        if (!b.uvs.empty()) {
          EXPECT_LT(uv_distance, 4.0f / 16384.0f);
        }
      }
    }
  EXPECT_GT(normals, 1000u);
  EXPECT_GT(uvs, 1000u);
}

TEST(GltfExport, WorldSpaceNeighboursDecodeToTheSameBits) {
  // Two adjacent grids share the points at x = 1.
  Scene scene = test::scene_of(test::grid_mesh(16, 0.2f));
  test::add_shape(scene, test::grid_mesh(16, 0.2f), test::translation({1, 0, 0}));
  scene.materials.push_back({"other", 0, Vec3(0.1f), kNoMask, kNoMask});
  scene.shapes.back().material = 1;
  const BakedScene baked = test::bake(scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  const tinygltf::Model model = parse(export_of(file));
  std::map<LatticePoint, std::set<std::array<float, 3>>> bits;
  const double step = step_of(file, 0);
  for (const tinygltf::Mesh& mesh : model.meshes)
    for (const tinygltf::Primitive& primitive : mesh.primitives)
      for (const Vec3& p : part_of(model, primitive).positions)
        bits[{std::llround(p.x / step), std::llround(p.y / step), std::llround(p.z / step)}].insert({p.x, p.y, p.z});
  for (const auto& [point, values] : bits) EXPECT_EQ(values.size(), 1u);
}

TEST(GltfExport, MaterialsHaveMasksAndFlags) {
  const BakedScene baked = test::bake(test::mixed_scene());
  const tinygltf::Model model = parse(export_of(BakedFile::from_bytes(baked.bytes)));
  const auto leaf =
      std::find_if(model.materials.begin(), model.materials.end(), [](const auto& m) { return m.name == "leaf"; });
  ASSERT_NE(leaf, model.materials.end());
  EXPECT_EQ(leaf->alphaMode, "MASK");
  EXPECT_EQ(leaf->extras.Get("flags").GetNumberAsInt(), static_cast<int>(kAlphaMask));
  EXPECT_EQ(leaf->pbrMetallicRoughness.baseColorFactor, (std::vector<double>{0.5, 0.5, 0.5, 1.0}));
  const tinygltf::Texture& texture =
      model.textures[static_cast<size_t>(leaf->pbrMetallicRoughness.baseColorTexture.index)];
  const tinygltf::Image& image = model.images[static_cast<size_t>(texture.source)];
  ASSERT_EQ(image.width, 64);
  ASSERT_EQ(image.height, 32);
  ASSERT_EQ(image.component, 4);
  for (size_t x = 0; x < 64; ++x) EXPECT_EQ(image.image[4 * x + 3], x % 8 < 4 ? 255 : 0);
  // v counts from the bottom: 1 - (2 v + 1/4) from the top.
  const tinygltf::Value& transform = leaf->pbrMetallicRoughness.baseColorTexture.extensions.at("KHR_texture_transform");
  EXPECT_EQ(transform.Get("scale").Get(1).GetNumberAsDouble(), -2.0);
  EXPECT_EQ(transform.Get("offset").Get(0).GetNumberAsDouble(), 0.25);
  EXPECT_EQ(transform.Get("offset").Get(1).GetNumberAsDouble(), 0.75);
}

TEST(GltfExport, CamerasSeeTheSame) {
  Scene scene = test::mixed_scene();
  Camera camera;
  camera.world_from_camera = *look_at({3, 4, -9}, {0.5, 0, 0}, {0, 1, 0});
  camera.fov_degrees = 50.0;
  camera.width_px = 640, camera.height_px = 360;
  scene.cameras.push_back(camera);
  const BakedScene baked = test::bake(scene);
  const tinygltf::Model model = parse(export_of(BakedFile::from_bytes(baked.bytes)));
  ASSERT_EQ(model.cameras.size(), 1u);
  const tinygltf::PerspectiveCamera& lens = model.cameras[0].perspective;
  EXPECT_NEAR(lens.yfov, 50.0 * std::numbers::pi / 180.0, 1e-12); // along the shorter axis
  EXPECT_NEAR(lens.aspectRatio, 640.0 / 360.0, 1e-12);
  glm::dmat4 node(1.0), mirror(1.0);
  for (int i = 0; i < 16; ++i) node[i / 4][i % 4] = model.nodes.back().matrix[static_cast<size_t>(i)];
  mirror[0][0] = -1.0;
  const glm::dmat4 global = mirror * node;
  EXPECT_NEAR(glm::determinant(glm::dmat3(global)), 1.0, 1e-9) << "cameras must not be mirrored";
  const DVec3 point(0.3, 0.7, 0.2);
  const DVec3 here = transform_point(inverse(camera.world_from_camera), point);
  const glm::dvec4 there = glm::inverse(global) * mirror * glm::dvec4(point, 1.0);
  EXPECT_NEAR(there.x / -there.z, here.x / here.z, 1e-9);
  EXPECT_NEAR(there.y / -there.z, here.y / here.z, 1e-9);
}

TEST(GltfExport, InstancesWithOtherMaterialsShareBuffers) {
  Scene scene = test::scene_of(test::sphere_mesh(12));
  scene.shapes.clear();
  scene.materials.push_back({"red", 0, Vec3(1, 0, 0), kNoMask, kNoMask});
  for (uint32_t m = 0; m < 2; ++m) {
    scene.objects.push_back({"ball", {Shape{0, m, false, DAffine(1.0)}}});
    scene.instances.push_back({m, Affine(test::translation({3.0 * m, 0, 0}))});
  }
  const BakedScene baked = test::bake(scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  ASSERT_EQ(file.geometries().size(), 1u);
  const tinygltf::Model model = parse(export_of(file));
  ASSERT_EQ(model.meshes.size(), 2u);
  EXPECT_EQ(model.meshes[0].primitives[0].attributes, model.meshes[1].primitives[0].attributes);
  EXPECT_NE(model.meshes[0].primitives[0].material, model.meshes[1].primitives[0].material);
}

TEST(GltfExport, CollapsedTrianglesAreCounted) {
  Mesh mesh = test::grid_mesh(4);
  mesh.triangles.push_back(Triangle(3, 3, 4));
  const BakedScene baked = test::bake(test::scene_of(mesh));
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  const uint64_t all = faces_of(file, 0).size();
  const GltfExport coded = export_of(file), exact = export_of(file, plain());
  EXPECT_EQ(exact.report.triangles, all);
  EXPECT_EQ(coded.report.triangles + coded.report.collapsed_triangles, all);
}

TEST(GltfExport, GeometryBeyondDracosBitsIsStoredAsFloats) {
  Scene scene = test::scene_of(test::grid_mesh(8));
  test::add_shape(scene, test::grid_mesh(9), test::translation({3e6, 0, 0}));
  BakeConfig config;
  config.precision_kind = PrecisionKind::kAbsolute;
  config.precision = 1e-4;
  const BakedScene baked = test::bake(scene, config);
  const GltfExport result = export_of(BakedFile::from_bytes(baked.bytes));
  EXPECT_EQ(result.report.plain_primitives, 2u);
  EXPECT_TRUE(parse(result).extensionsRequired.empty());
}

TEST(GltfExport, LeavesOutLevelsOfDetail) {
  const Scene scene = test::scene_of(test::sphere_mesh(20));
  BakeConfig config;
  config.lod = LodUse::kAll;
  const BakedFile without = BakedFile::from_bytes(test::bake(scene).bytes);
  const BakedFile with = BakedFile::from_bytes(test::bake(scene, config).bytes);
  ASSERT_GT(with.geometries().size(), without.geometries().size());
  EXPECT_EQ(export_of(with).bytes, export_of(without).bytes);
}

TEST(GltfExport, EmptyScenesAreFiles) {
  const BakedScene baked = test::bake(Scene{});
  const tinygltf::Model model = parse(export_of(BakedFile::from_bytes(baked.bytes)));
  EXPECT_TRUE(model.meshes.empty());
}

TEST(GltfExport, BytesDoNotDependOnThreads) {
  const BakedScene baked = test::bake(test::mixed_scene());
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  const GltfExport many = export_of(file);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(export_of(file).bytes, many.bytes);
}

TEST(GltfExport, RefusesValuesOutOfRange) {
  const BakedScene baked = test::bake(Scene{});
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  for (const DracoConfig codec : {DracoConfig{11, 12, 14}, DracoConfig{7, 1, 14}, DracoConfig{7, 12, 31}}) {
    GltfConfig config;
    config.draco = codec;
    EXPECT_THROW(export_of(file, config), Error);
  }
}

} // namespace
} // namespace packtrace
