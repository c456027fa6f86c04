#include "compress/bake/bake_scene.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/compress/bake_checks.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

using test::bake, test::decode, test::Decoded, test::scene_of, test::holds, test::precision, test::masked_scene,
    test::winding_agreement;

TEST(BakeScene, EveryTriangleSurvivesOnTheNearestLatticePoints) {
  for (const Mesh& mesh :
       {test::grid_mesh(1), test::grid_mesh(50, 0.1f, true), test::sphere_mesh(30), test::soup_mesh(700, 2)}) {
    const BakedScene baked = bake(scene_of(mesh));
    EXPECT_TRUE(holds(BakedFile::from_bytes(baked.bytes), 0, mesh));
    EXPECT_EQ(baked.report.file.triangles, mesh.triangles.size());
    EXPECT_LE(baked.report.max_position_error, baked.report.world_step * 0.5 * (1 + 1e-6) + 1e-7);
  }
}

TEST(BakeScene, TriangleNumbersFindTheirCluster) {
  const BakedFile file = BakedFile::from_bytes(bake(scene_of(test::grid_mesh(40))).bytes);
  uint32_t triangle = 0;
  for (uint32_t c = 0; c < file.clusters(0).size(); ++c)
    for (uint32_t i = 0; i < file.clusters(0)[c].triangle_count; ++i)
      EXPECT_EQ(file.cluster_of_triangle(0, triangle++), c);
  EXPECT_EQ(triangle, file.geometries()[0].triangle_count);
}

TEST(BakeScene, PrecisionIsKept) {
  const Mesh mesh = test::sphere_mesh(30, 10.0f);
  const auto step = [&](PrecisionKind kind, double value) {
    return bake(scene_of(mesh), precision(kind, value)).report.world_step;
  };
  EXPECT_LE(step(PrecisionKind::kAbsolute, 0.01), 0.01);
  EXPECT_GT(step(PrecisionKind::kAbsolute, 0.01), 0.0088);
  EXPECT_LE(step(PrecisionKind::kPositionBits, 10), 20.0 / 1023);
  EXPECT_GT(step(PrecisionKind::kPositionBits, 10), 20.0 / 1023 * 0.88);
  EXPECT_LE(step(PrecisionKind::kDiagonalFraction, 1e-3), 20.0 * std::sqrt(3.0) * 1e-3 * (1 + 1e-6));
  const BakeReport by_edge = bake(scene_of(mesh), precision(PrecisionKind::kEdgeFraction, 0.25)).report;
  EXPECT_LE(by_edge.world_step, by_edge.world_median_edge * 0.25);
  EXPECT_GT(by_edge.world_step, by_edge.world_median_edge * 0.22);
  EXPECT_NEAR(by_edge.world_median_edge, 0.95, 0.15);
  ASSERT_FALSE(by_edge.warnings.empty());
  EXPECT_NE(by_edge.warnings[0].find("above an eighth of their median edge"), std::string::npos);
}

TEST(BakeScene, AbsolutePrecisionHoldsInTheWorldAlsoUnderScaledInstances) {
  Scene scene = scene_of(test::grid_mesh(2));
  scene.meshes.push_back(test::sphere_mesh(8));
  scene.objects.push_back({"ball", {Shape{1, 0, false, DAffine(1.0)}}});
  scene.instances.push_back({0, Affine(test::scaling({1, 50, 1}))});
  const BakedFile file = BakedFile::from_bytes(bake(scene, precision(PrecisionKind::kAbsolute, 0.1)).bytes);
  const baked::GeometryRecord& ball = file.geometries()[1];
  EXPECT_LE((PositionGrid{ball.step_mantissa, ball.step_exponent}.step()) * 50, 0.1);
}

TEST(BakeScene, ExtremeScalesAndPlacesKeepTheBound) {
  struct {
    const char* what;
    DAffine transform;
    bool has_area;
  } const cases[] = {{"tiny", test::scaling(DVec3(1e-30)), true},
                     {"huge", test::scaling(DVec3(1e30)), true},
                     {"denormal", test::scaling(DVec3(1e-41)), true},
                     {"far", test::translation(DVec3(1e7, -1e7, 1e7)), true},
                     {"flat", test::scaling(DVec3(1, 0, 1)), true},
                     {"line", test::scaling(DVec3(0, 3, 0)), false},
                     {"point", test::scaling(DVec3(0)), false},
                     {"far point", compose(test::translation(DVec3(1e20)), test::scaling(DVec3(0))), false},
                     {"wide range", test::scaling(DVec3(1e-6, 1.0, 1e6)), true}};
  for (const auto& c : cases) {
    const Mesh mesh = test::sphere_mesh(12);
    const BakedFile file = BakedFile::from_bytes(bake(scene_of(mesh, c.transform)).bytes);
    const baked::GeometryRecord& record = file.geometries()[0];
    EXPECT_LE(record.max_position_error, record.position_error_bound) << c.what;
    // On a line and at a point no triangle has an area. The default step resolves the second widest axis.
    EXPECT_EQ(record.triangle_count + file.summary().collapsed_triangles, mesh.triangles.size()) << c.what;
    EXPECT_TRUE(record.triangle_count == 0 || holds(file, 0, mesh, c.transform)) << c.what;
    EXPECT_EQ(record.triangle_count > 0, c.has_area) << c.what;
  }
}

TEST(BakeScene, SharedVerticesDoNotCrack) {
  // Four patches with a bumpy common border, baked as four shapes with different transforms.
  Scene scene;
  scene.materials.push_back({});
  const Mesh whole = test::grid_mesh(64, 0.2f);
  for (uint32_t part = 0; part < 4; ++part) {
    Mesh mesh;
    const DVec3 offset(part * 0.125, -0.25 * part, 0.5); // exact in float, so the placed vertices agree exactly
    for (const Vec3 p : whole.positions) mesh.positions.push_back(p - Vec3(offset));
    for (size_t i = 0; i < whole.triangles.size(); ++i)
      if (i * 4 / whole.triangles.size() == part) mesh.triangles.push_back(whole.triangles[i]);
    // The subtraction rounds, so the placed vertices of neighbouring parts may differ; snap to values that all parts
    // hold exactly.
    for (Vec3& p : mesh.positions) p = glm::round(p * 4096.0f) / 4096.0f;
    test::add_shape(scene, std::move(mesh), test::translation(offset));
  }
  const BakedFile file = BakedFile::from_bytes(bake(scene, precision(PrecisionKind::kEdgeFraction, 0.3)).bytes);
  std::map<std::pair<std::array<float, 3>, std::array<float, 3>>, int> edges;
  for (uint32_t g = 0; g < 4; ++g) {
    const Decoded all = decode(file, g);
    for (const Triangle& t : all.triangles)
      for (int e = 0; e < 3; ++e) {
        const Vec3 a = all.positions[t[e]], b = all.positions[t[(e + 1) % 3]];
        std::array<float, 3> from = {a.x, a.y, a.z}, to = {b.x, b.y, b.z};
        if (to < from) std::swap(from, to);
        ++edges[{from, to}];
      }
  }
  const auto open = std::count_if(edges.begin(), edges.end(), [](const auto& e) { return e.second == 1; });
  EXPECT_EQ(open, 4 * 64); // only the outer border
}

TEST(BakeScene, WindingCarriesTheNormalThroughMirrors) {
  const DAffine mirror = test::scaling({-1, 2, 1});
  for (const bool mirrored : {false, true}) {
    Scene scene = scene_of(test::sphere_mesh(16), mirrored ? mirror : DAffine(1.0));
    EXPECT_GT(winding_agreement(decode(BakedFile::from_bytes(bake(scene).bytes), 0)), 0.5);
    scene.shapes[0].reverse_orientation = true;
    const Decoded reversed = decode(BakedFile::from_bytes(bake(scene).bytes), 0);
    EXPECT_LT(winding_agreement(reversed), -0.5);
    for (size_t i = 0; i < reversed.positions.size(); ++i) // shading normals are unchanged
      EXPECT_GT(glm::dot(reversed.normals[i], reversed.positions[i]), 0.0f);
  }
}

TEST(BakeScene, WindingCarriesTheNormalThroughMirrorsInsideObjects) {
  Scene scene;
  scene.materials.push_back({});
  scene.meshes.push_back(test::sphere_mesh(16));
  scene.objects.push_back({"pair", {Shape{0, 0, false, test::scaling({1, 1, -1})}, Shape{0, 0, false, DAffine(1.0)}}});
  scene.instances.push_back({0, Affine(test::scaling({-1, 1, 1}))}); // the mirror of an instance is left to the tracer
  EXPECT_GT(winding_agreement(decode(BakedFile::from_bytes(bake(scene).bytes), 0)), 0.5);
}

TEST(BakeScene, BytesDoNotDependOnThreads) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  Scene scene = scene_of(test::grid_mesh(150, 0.3f, true)); // large enough for several parallel chunks
  for (uint32_t i = 0; i < 20; ++i)
    test::add_shape(scene, test::sphere_mesh(4 + i), test::translation({static_cast<double>(i), 0, 0}));
  test::add_shape(scene, test::soup_mesh(3000, 5));
  std::vector<std::vector<std::byte>> results;
  for (const size_t threads : {size_t{1}, size_t{2}, size_t{3}, size_t{8}, size_t{8}}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    results.push_back(bake(scene).bytes);
  }
  for (const auto& result : results) EXPECT_TRUE(result == results[0]);
}

TEST(BakeScene, ClustersOfAMaterialClassAreContiguous) {
  Scene scene = masked_scene();
  scene.shapes.clear();
  scene.meshes.push_back(test::sphere_mesh(12));
  const auto shape = [](uint32_t mesh, uint32_t material) { return Shape{mesh, material, false, DAffine(1.0)}; };
  scene.objects.push_back({"mixed", {shape(0, 1), shape(0, 2), shape(1, 0), shape(1, 1), shape(0, 0)}});
  scene.instances.push_back({0, Affine(1.0f)});
  const BakedFile file = BakedFile::from_bytes(bake(scene).bytes);
  const baked::GeometryRecord& g = file.geometries()[0];
  uint32_t cluster = 0;
  for (uint32_t c = 0; c < 8; ++c)
    for (uint32_t i = 0; i < g.class_clusters[c]; ++i)
      EXPECT_EQ(baked::material_class(
                    scene.materials[file.instance_materials(0)[file.clusters(0)[cluster++].material_slot]].flags),
                c);
  EXPECT_EQ(cluster, g.cluster_count);
  EXPECT_GT(g.class_clusters[0], 0u);
  EXPECT_GT(g.class_clusters[2], 0u); // clusters that do not occlude
  EXPECT_GT(g.class_clusters[4], 0u); // masked clusters
}

} // namespace
} // namespace packtrace
