#include "compress/bake/bake_scene.h"

#include <algorithm>
#include <limits>
#include <map>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "pbrt_import/scene/error.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

using test::bake;
using test::decode;
using test::Decoded;
using test::scene_of;

using LatticeTriangle = std::array<LatticePoint, 3>;

/// Counts triangles by their lattice corners, starting at the smallest: equal maps mean equal triangles and winding.
class TriangleCensus {
public:
  void add(LatticeTriangle t, int by) {
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    // Two equal smallest corners leave two rotations; take the smaller one.
    const LatticeTriangle second = {t[1], t[2], t[0]}, third = {t[2], t[0], t[1]};
    counts_[std::min({t, second, third})] += by;
  }
  bool balanced() const {
    return std::all_of(counts_.begin(), counts_.end(), [](const auto& entry) { return entry.second == 0; });
  }

private:
  std::map<LatticeTriangle, int> counts_;
};

/// Whether geometry `g` holds exactly the mesh's triangles, each corner on the nearest lattice point.
bool holds(const BakedFile& file, uint32_t g, const Mesh& mesh, const DAffine& transform = DAffine(1.0),
           bool flip = false) {
  const baked::GeometryRecord& record = file.geometries()[g];
  const double step = PositionGrid{record.step_mantissa, record.step_exponent}.step();
  TriangleCensus census;
  for (const Triangle& t : mesh.triangles) {
    LatticeTriangle lattice;
    for (size_t corner = 0; corner < 3; ++corner) {
      const DVec3 p = transform_point(transform, DVec3(mesh.positions[t[static_cast<int>(corner)]]));
      lattice[corner] = {to_lattice(p.x, step), to_lattice(p.y, step), to_lattice(p.z, step)};
    }
    if (flip) std::swap(lattice[1], lattice[2]);
    census.add(lattice, 1);
  }
  for (uint32_t c = 0; c < file.clusters(g).size(); ++c) {
    const ClusterView view = file.cluster(g, c);
    for (uint32_t i = 0; i < view.triangle_count(); ++i) {
      const Triangle t = view.triangle(i);
      census.add({view.lattice(t.x), view.lattice(t.y), view.lattice(t.z)}, -1);
    }
  }
  return census.balanced();
}

ErrorKind bake_kind(const Scene& scene, const BakeConfig& config = {}) {
  try {
    (void)bake(scene, config);
  } catch (const Error& error) {
    return error.kind();
  }
  ADD_FAILURE() << "the scene was accepted";
  return ErrorKind::kCancelled;
}

BakeConfig precision(PrecisionKind kind, double value) {
  BakeConfig config;
  config.precision_kind = kind;
  config.precision = value;
  return config;
}

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
  } const cases[] = {{"tiny", test::scaling(DVec3(1e-30))},
                     {"huge", test::scaling(DVec3(1e30))},
                     {"denormal", test::scaling(DVec3(1e-41))},
                     {"far", test::translation(DVec3(1e7, -1e7, 1e7))},
                     {"flat", test::scaling(DVec3(1, 0, 1))},
                     {"line", test::scaling(DVec3(0, 3, 0))},
                     {"point", test::scaling(DVec3(0))},
                     {"far point", compose(test::translation(DVec3(1e20)), test::scaling(DVec3(0)))},
                     {"wide range", test::scaling(DVec3(1e-6, 1.0, 1e6))}};
  for (const auto& c : cases) {
    const Mesh mesh = test::sphere_mesh(12);
    const BakedFile file = BakedFile::from_bytes(bake(scene_of(mesh, c.transform)).bytes);
    const baked::GeometryRecord& record = file.geometries()[0];
    EXPECT_EQ(record.triangle_count, mesh.triangles.size()) << c.what;
    EXPECT_LE(record.max_position_error, record.position_error_bound) << c.what;
    EXPECT_TRUE(holds(file, 0, mesh, c.transform)) << c.what;
  }
}

TEST(BakeScene, SharedVerticesDoNotCrack) {
  // Four patches with a bumpy common border, baked as four shapes whose transforms differ.
  Scene scene;
  scene.materials.push_back({});
  const Mesh whole = test::grid_mesh(64, 0.2f);
  for (uint32_t part = 0; part < 4; ++part) {
    Mesh mesh;
    const DVec3 offset(part * 0.125, -0.25 * part, 0.5); // exact in float: the placed vertices agree exactly
    for (const Vec3 p : whole.positions) mesh.positions.push_back(p - Vec3(offset));
    for (size_t i = 0; i < whole.triangles.size(); ++i)
      if (i * 4 / whole.triangles.size() == part) mesh.triangles.push_back(whole.triangles[i]);
    // Rounding in the subtraction moves vertices by what the placed ones disagree; snap to what all parts can hold.
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
  EXPECT_EQ(open, 4 * 64); // the outer border of the whole and nothing else
}

double winding_agreement(const Decoded& all) { // smallest cosine between winding normal and direction from the origin
  double worst = 1.0;
  for (const Triangle& t : all.triangles) {
    const DVec3 a(all.positions[t.x]), b(all.positions[t.y]), c(all.positions[t.z]);
    worst = std::min(worst, glm::dot(glm::normalize(glm::cross(b - a, c - a)), glm::normalize(a + b + c)));
  }
  return worst;
}

TEST(BakeScene, WindingCarriesTheNormalThroughMirrors) {
  const DAffine mirror = test::scaling({-1, 2, 1});
  for (const bool mirrored : {false, true}) {
    Scene scene = scene_of(test::sphere_mesh(16), mirrored ? mirror : DAffine(1.0));
    EXPECT_GT(winding_agreement(decode(BakedFile::from_bytes(bake(scene).bytes), 0)), 0.5);
    scene.shapes[0].reverse_orientation = true;
    const Decoded reversed = decode(BakedFile::from_bytes(bake(scene).bytes), 0);
    EXPECT_LT(winding_agreement(reversed), -0.5);
    for (size_t i = 0; i < reversed.positions.size(); ++i) // shading normals stay as given
      EXPECT_GT(glm::dot(reversed.normals[i], reversed.positions[i]), 0.0f);
  }
}

TEST(BakeScene, WindingCarriesTheNormalThroughMirrorsInsideObjects) {
  Scene scene;
  scene.materials.push_back({});
  scene.meshes.push_back(test::sphere_mesh(16));
  scene.objects.push_back({"pair", {Shape{0, 0, false, test::scaling({1, 1, -1})}, Shape{0, 0, false, DAffine(1.0)}}});
  scene.instances.push_back({0, Affine(test::scaling({-1, 1, 1}))}); // an instance's mirror is the tracer's business
  EXPECT_GT(winding_agreement(decode(BakedFile::from_bytes(bake(scene).bytes), 0)), 0.5);
}

TEST(BakeScene, EqualMeshesAreStoredOnceAndInstanced) {
  Scene scene;
  scene.materials.push_back({});
  scene.materials.push_back({});
  test::add_shape(scene, test::grid_mesh(20), test::translation({9, 0, 0}));
  for (const double x : {1.0, 2.0, 3.0}) test::add_shape(scene, test::sphere_mesh(16), test::translation({x, 0, 0}));
  scene.shapes[2].parent_from_mesh = test::scaling({-1, 1, 1});
  scene.materials[1].flags = kTransmissive;
  test::add_shape(scene, test::sphere_mesh(16), test::translation({4, 0, 0}), 1); // another class
  const BakedScene baked = bake(scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  ASSERT_EQ(file.geometries().size(), 3u);
  EXPECT_EQ(baked.report.shared_shapes, 2u);
  ASSERT_EQ(file.instances().size(), 5u);
  const std::array<uint32_t, 5> expected = {0, 1, 1, 1, 2};
  for (uint32_t i = 0; i < 5; ++i) EXPECT_EQ(file.instances()[i].geometry, expected[i]);
  EXPECT_EQ(file.world_from_object(1)[3], Vec3(1, 0, 0));
  EXPECT_EQ(file.world_from_object(2)[0], Vec3(-1, 0, 0));
  EXPECT_EQ(file.world_from_object(4), Affine(1.0f)); // not shared: in world space
  EXPECT_EQ(file.geometries()[1].flags & baked::kWorldSpace, 0u);
  EXPECT_NE(file.geometries()[2].flags & baked::kWorldSpace, 0u);
  EXPECT_GT(winding_agreement(decode(file, 1)), 0.5);
}

std::vector<uint32_t> materials_of(const BakedFile& file, uint32_t instance) {
  const auto materials = file.instance_materials(instance);
  return {materials.begin(), materials.end()};
}

TEST(BakeScene, ShapesThatDifferInMaterialShareAGeometry) {
  Scene scene;
  scene.materials.resize(4);
  scene.materials[1].flags = kMirror; // of the same class as none
  scene.materials[2].flags = kInvisible;
  scene.materials[3].albedo = Vec3(1);
  for (const uint32_t material : {0u, 1u, 2u, 3u, 1u})
    test::add_shape(scene, test::sphere_mesh(16), test::translation({1.0 * material, 0, 0}), material);
  const BakedScene baked = bake(scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  ASSERT_EQ(file.geometries().size(), 2u);
  const std::array<uint32_t, 5> geometries = {0, 0, 1, 0, 0}, materials = {0, 1, 2, 3, 1};
  for (uint32_t i = 0; i < 5; ++i) {
    EXPECT_EQ(file.instances()[i].geometry, geometries[i]);
    EXPECT_EQ(materials_of(file, i), std::vector{materials[i]});
  }
  EXPECT_EQ(file.sections().material_slots.size(), 4u); // equal choices are stored once
  EXPECT_EQ(baked.report.shared_shapes, 3u);
  EXPECT_EQ(baked.report.instanced_shapes, 4u);
}

TEST(BakeScene, ShapesInOnePlaceShareAWorldSpaceGeometry) {
  Scene scene;
  scene.materials.resize(2);
  for (const uint32_t material : {0u, 1u}) test::add_shape(scene, test::grid_mesh(3), DAffine(1.0), material);
  const BakedFile file = BakedFile::from_bytes(bake(scene).bytes);
  ASSERT_EQ(file.geometries().size(), 1u);
  EXPECT_NE(file.geometries()[0].flags & baked::kWorldSpace, 0u);
  EXPECT_EQ(materials_of(file, 1), std::vector{1u});
}

TEST(BakeScene, ShapesOfOneMeshShareItHoweverSmall) {
  Scene scene;
  scene.materials.resize(1000);
  scene.meshes.push_back(test::sphere_mesh(3));
  for (uint32_t i = 0; i < 1000; ++i) scene.shapes.emplace_back(0, i, false, test::translation({3.0 * i, 0, 0}));
  scene.objects.push_back({"the same", {Shape{0, 7, false, DAffine(1.0)}}});
  scene.instances.push_back({0, Affine(test::translation({0, 0, 9}))});
  const BakedScene baked = bake(scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  EXPECT_EQ(file.geometries().size(), 1u);
  EXPECT_EQ(file.geometries()[0].triangle_count, scene.meshes[0].triangles.size());
  EXPECT_EQ(materials_of(file, 999), std::vector{999u});
  EXPECT_EQ(materials_of(file, 1000), std::vector{7u});
  EXPECT_EQ(file.world_from_object(999)[3], Vec3(2997, 0, 0));
  EXPECT_EQ(baked.report.touching_instances, 0u);
  EXPECT_TRUE(baked.report.warnings.empty());
  EXPECT_LT(baked.bytes.size(), 1001 * (sizeof(baked::InstanceRecord) + 4 + sizeof(baked::MaterialRecord)) + 4096);
}

TEST(BakeScene, InstancedShapesCountForTheScenesStep) {
  // A floor of two large triangles below many small spheres, which would lose its place if the floor alone counted.
  Scene scene = scene_of(test::grid_mesh(1), compose(test::translation({-50, -50, -1}), test::scaling(DVec3(100))));
  scene.meshes.push_back(test::sphere_mesh(8));
  for (uint32_t i = 0; i < 20; ++i)
    scene.shapes.emplace_back(
        1, 0, false, compose(test::translation({2.0 * i, 0, 0}), test::scaling(DVec3(i % 2 == 0 ? 0.5 : 1.0))));
  const BakeReport shared = bake(scene).report;
  EXPECT_EQ(shared.instanced_shapes, 20u);
  Scene wide = scene;
  wide.shapes[20].parent_from_mesh = test::translation({1000, 0, 0});
  EXPECT_GT(bake(wide, precision(PrecisionKind::kPositionBits, 14.0)).report.world_step, 1000.0 / (1 << 14) * 0.88);
  for (uint32_t i = 1; i < 21; ++i) { // the same as meshes that nothing shares
    Mesh own = scene.meshes[1];
    own.positions[0].z *= 1.0f + 1e-3f * static_cast<float>(i);
    scene.shapes[i].mesh = static_cast<uint32_t>(scene.meshes.size());
    scene.meshes.push_back(own);
  }
  const BakeReport apart = bake(scene).report;
  EXPECT_EQ(apart.instanced_shapes, 0u);
  EXPECT_NEAR(shared.world_median_edge, apart.world_median_edge, 0.04 * apart.world_median_edge);
  EXPECT_LT(shared.world_median_edge, 1.0);
}

TEST(BakeScene, InstancesOnGridsOfTheirOwnThatTouchAreCounted) {
  Scene scene;
  scene.materials.resize(1);
  scene.meshes.push_back(test::sphere_mesh(8)); // radius 1
  for (const double x : {0.0, 2.0, 9.0}) scene.shapes.emplace_back(0, 0, false, test::translation({x, 0, 0}));
  const BakeReport report = bake(scene).report;
  EXPECT_EQ(report.instanced_shapes, 3u);
  EXPECT_EQ(report.touching_instances, 2u);
  ASSERT_EQ(report.warnings.size(), 1u);
  EXPECT_NE(report.warnings[0].find("the boxes of 2 of 3 instances touch"), std::string::npos) << report.warnings[0];
  test::add_shape(scene, test::grid_mesh(2), test::translation({8.5, 0, 0}));
  EXPECT_EQ(bake(scene).report.touching_instances, 3u);
}

TEST(BakeScene, ObjectsThatDifferInMaterialShareAGeometry) {
  // Walls, roof and door: one house has a material for all, the others differ in which parts have the same.
  Scene scene;
  scene.materials.resize(5);
  scene.materials[4].flags = kTransmissive;
  scene.meshes = {test::grid_mesh(3), test::sphere_mesh(6), test::grid_mesh(4), {}};
  const auto house = [](uint32_t wall, uint32_t roof, uint32_t door) {
    const auto shape = [](uint32_t mesh, uint32_t material) { return Shape{mesh, material, false, DAffine(1.0)}; };
    return std::vector{shape(3, 1), shape(0, wall), shape(1, roof), shape(2, door)};
  };
  scene.objects = {
      {"plain", house(0, 0, 0)}, {"two", house(1, 2, 1)}, {"two others", house(3, 0, 3)}, {"glass", house(4, 0, 0)}};
  scene.instances = {{1, Affine(1.0f)}, {0, Affine(1.0f)}, {3, Affine(1.0f)}, {2, Affine(1.0f)}};
  const BakedScene baked = bake(scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  ASSERT_EQ(file.geometries().size(), 2u);
  EXPECT_EQ(baked.report.shared_objects, 2u);
  // Wall and door share a slot: no object tells them apart.
  EXPECT_EQ(materials_of(file, 0), (std::vector{1u, 2u}));
  EXPECT_EQ(materials_of(file, 1), (std::vector{0u, 0u}));
  EXPECT_EQ(materials_of(file, 3), (std::vector{3u, 0u}));
  EXPECT_EQ(materials_of(file, 2), (std::vector{0u, 4u})); // by class: what occludes comes first
  const Decoded all = decode(file, file.instances()[0].geometry);
  EXPECT_EQ(std::count(all.slots.begin(), all.slots.end(), 0u), 18 + 32);
  EXPECT_EQ(std::count(all.slots.begin(), all.slots.end(), 1u), std::ssize(scene.meshes[1].triangles));
}

TEST(BakeScene, SmallEqualMeshesStayInWorldSpaceSoThatTheyTouch) {
  Scene scene;
  scene.materials.push_back({});
  for (const double x : {0.0, 1.0}) test::add_shape(scene, test::grid_mesh(4), test::translation({x, 0, 0}));
  EXPECT_EQ(BakedFile::from_bytes(bake(scene).bytes).geometries().size(), 2u);
  scene.shapes[1].parent_from_mesh = scene.shapes[0].parent_from_mesh; // the same place: nothing to lose
  EXPECT_EQ(BakedFile::from_bytes(bake(scene).bytes).geometries().size(), 1u);
}

TEST(BakeScene, EqualObjectsShareAGeometryAndUnusedOnesAreLeftOut) {
  Scene scene;
  scene.materials.push_back({});
  scene.meshes = {test::sphere_mesh(8), test::sphere_mesh(8), test::grid_mesh(3)};
  scene.objects = {{"a", {Shape{0, 0, false, DAffine(1.0)}}},
                   {"unused", {Shape{2, 0, false, DAffine(1.0)}}},
                   {"b", {Shape{1, 0, false, DAffine(1.0)}}},
                   {"empty", {}}};
  scene.instances = {{2, Affine(1.0f)}, {0, Affine(1.0f)}, {3, Affine(1.0f)}};
  const BakedScene baked = bake(scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  EXPECT_EQ(file.geometries().size(), 2u);
  EXPECT_EQ(file.instances()[0].geometry, file.instances()[1].geometry);
  EXPECT_EQ(baked.report.shared_objects, 1u);
  EXPECT_EQ(baked.report.unused_objects, 1u);
  EXPECT_EQ(baked.report.unused_triangles, 18u);
  EXPECT_EQ(file.geometries()[file.instances()[2].geometry].triangle_count, 0u);
}

TEST(BakeScene, BytesDoNotDependOnThreads) {
  Scene scene = scene_of(test::grid_mesh(150, 0.3f, true)); // several chunks
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

BakeConfig normals(std::optional<NormalEncoding> encoding, double error_degrees = 0.04) {
  BakeConfig config;
  config.normals = encoding;
  config.normal_error_degrees = error_degrees;
  return config;
}

TEST(BakeScene, NormalsComeBackWithinTheErrorOfEachEncoding) {
  const Mesh mesh = test::sphere_mesh(30);
  for (uint32_t i = 0; i < kNormalFormats.size(); ++i) {
    const auto encoding = static_cast<NormalEncoding>(i);
    const BakedScene baked = bake(scene_of(mesh), normals(encoding));
    const BakedFile file = BakedFile::from_bytes(baked.bytes);
    EXPECT_EQ(file.geometries()[0].normal_encoding, i);
    const double limit = kNormalFormats[i].max_error_degrees;
    const Decoded all = decode(file, 0);
    for (size_t v = 0; v < all.positions.size(); ++v) // on a unit sphere positions are normals, to .2 degrees here
      EXPECT_GT(glm::dot(all.normals[v], glm::normalize(all.positions[v])), std::cos((limit + 0.2) / 57.29));
    EXPECT_LE(baked.report.max_normal_error_degrees, limit) << kNormalFormats[i].name;
    if (encoding != NormalEncoding::kZsign32) { // whose worst normals are few
      EXPECT_GT(baked.report.max_normal_error_degrees, 0.3 * limit);
    }
    EXPECT_GT(baked.report.mean_normal_error_degrees, 0.0);
    EXPECT_EQ(file.geometries()[0].max_normal_error_degrees, static_cast<float>(baked.report.max_normal_error_degrees));
  }
}

TEST(BakeScene, AutoTakesTheFewestBitsThatKeepTheError) {
  const auto chosen = [](const Mesh& mesh, double error_degrees) {
    const BakedScene baked = bake(scene_of(mesh), normals(std::nullopt, error_degrees));
    EXPECT_LE(baked.report.max_normal_error_degrees, error_degrees);
    const std::vector<NormalUse>& uses = baked.report.file.normals;
    EXPECT_EQ(uses.size(), 1u);
    EXPECT_EQ(uses.front().geometries, 1u);
    EXPECT_EQ(uses.front().vertices, baked.report.file.vertices);
    return uses.front().encoding;
  };
  const Mesh sphere = test::sphere_mesh(30);
  EXPECT_EQ(chosen(sphere, 1.0), NormalEncoding::kAxis16);
  EXPECT_EQ(chosen(sphere, 0.5), NormalEncoding::kAxis24);
  EXPECT_EQ(chosen(sphere, 0.04), NormalEncoding::kAxis24);
  EXPECT_EQ(chosen(sphere, 0.01), NormalEncoding::kAxis32);
  EXPECT_EQ(chosen(sphere, 0.0025), NormalEncoding::kAxis32);
  Mesh bent = test::grid_mesh(4); // every normal along an axis: any number of bits is enough
  for (size_t i = 0; i < bent.positions.size(); ++i)
    bent.normals.push_back(i % 2 == 0 ? Vec3(1, 0, 0) : Vec3(0, -1, 0));
  EXPECT_EQ(chosen(bent, 0.0025), NormalEncoding::kAxis16);
}

TEST(BakeScene, EveryPartOfAGeometryHasItsEncoding) {
  Scene scene;
  scene.materials.push_back({});
  Mesh bent = test::grid_mesh(4);
  bent.normals.assign(bent.positions.size(), Vec3(1, 0, 0));
  scene.meshes = {bent, test::sphere_mesh(12)};
  scene.objects.push_back({"two", {Shape{0, 0, false, DAffine(1.0)}, Shape{1, 0, false, DAffine(1.0)}}});
  scene.instances.push_back({0, Affine(1.0f)});
  const BakedFile file = BakedFile::from_bytes(bake(scene).bytes);
  EXPECT_EQ(file.geometries()[0].normal_encoding, static_cast<uint32_t>(NormalEncoding::kAxis24));
  const Decoded all = decode(file, 0);
  EXPECT_GE(std::count(all.normals.begin(), all.normals.end(), Vec3(1, 0, 0)), 25); // perhaps some of the sphere's too
}

TEST(BakeScene, FlatNormalsAreDroppedAndSaidToBe) {
  const BakedScene baked = bake(scene_of(test::grid_mesh(20, 0.0f, true)));
  EXPECT_EQ(baked.report.file.bytes.normals, 0u);
  const std::vector<baked::RequirementRecord>& rows = baked.report.file.requirements;
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[0].stream, baked::kNormals);
  EXPECT_EQ(rows[0].reason, baked::kInferred);
  EXPECT_EQ(rows[0].triangles, 800u);
  EXPECT_EQ(rows[0].source_bytes, 441u * 12);
  EXPECT_EQ(rows[1].stream, baked::kUvs);
  EXPECT_EQ(rows[1].reason, baked::kUnused);
  EXPECT_EQ(rows[1].source_bytes, 441u * 8);
  EXPECT_GT(bake(scene_of(test::grid_mesh(20, 0.2f, true))).report.file.bytes.normals, 0u);
}

TEST(BakeScene, SplitVerticesMerge) {
  Mesh mesh = test::grid_mesh(20, 0.1f, true);
  Mesh split; // every triangle with vertices of its own
  split.name = "split";
  for (const Triangle& t : mesh.triangles) {
    const auto base = static_cast<uint32_t>(split.positions.size());
    for (int corner = 0; corner < 3; ++corner) {
      split.positions.push_back(mesh.positions[t[corner]]);
      split.normals.push_back(mesh.normals[t[corner]]);
    }
    split.triangles.emplace_back(base, base + 1, base + 2);
  }
  mesh.uvs.clear();
  const BakedScene a = bake(scene_of(mesh)), b = bake(scene_of(split));
  EXPECT_EQ(b.report.merged_vertices, 2400u - 441u);
  EXPECT_EQ(a.report.merged_vertices, 0u);
  EXPECT_EQ(a.report.file.vertices, b.report.file.vertices);
}

Scene masked_scene() {
  Scene scene = scene_of(test::grid_mesh(12));
  AlphaMask mask;
  mask.width = 64, mask.height = 32;
  mask.words.assign(2 * 32, 0x0f0f0f0fu);
  scene.masks.push_back(mask);
  scene.materials.push_back({"leaf", kAlphaMask, Vec3(0.5f), 0, kNoMask});
  scene.materials.push_back({"glass", kTransmissive, Vec3(0.5f), kNoMask, kNoMask});
  return scene;
}

TEST(BakeScene, TextureCoordinatesAreKeptWhereAMaskNeedsThem) {
  Scene scene = masked_scene();
  const Mesh leaf = test::grid_mesh(12, 0.1f);
  test::add_shape(scene, leaf, DAffine(1.0), 1);
  const BakedScene baked = bake(scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  EXPECT_FALSE(file.cluster(0, 0).has_uvs());
  EXPECT_TRUE(file.cluster(1, 0).has_uvs());
  const Decoded all = decode(file, 1);
  for (size_t i = 0; i < all.positions.size(); ++i) { // the grid's uvs are its x and y
    EXPECT_NEAR(all.uvs[i].x, all.positions[i].x, 1.0 / (2 * 16 * 64) + 0.001);
    EXPECT_NEAR(all.uvs[i].y, all.positions[i].y, 1.0 / (2 * 16 * 32) + 0.001);
  }
  EXPECT_GT(baked.report.max_uv_error, 0.0);
  EXPECT_LE(baked.report.max_uv_error, 1.0 / (2 * 16 * 32));
}

TEST(BakeScene, EncodingsOfTextureCoordinatesAreSelectable) {
  Scene scene = masked_scene();
  scene.shapes[0].material = 1;
  for (const UvEncoding encoding : {UvEncoding::kUnorm16, UvEncoding::kFp16}) {
    BakeConfig config;
    config.uvs = encoding;
    const BakedScene baked = bake(scene, config);
    const BakedFile file = BakedFile::from_bytes(baked.bytes);
    EXPECT_EQ(file.geometries()[0].uv_encoding, static_cast<uint32_t>(encoding));
    EXPECT_EQ(file.geometries()[0].uv_exponent, (std::array<int32_t, 2>{}));
    ASSERT_EQ(baked.report.file.uvs.size(), 1u);
    EXPECT_EQ(baked.report.file.uvs[0].encoding, encoding);
    const float bound = encoding == UvEncoding::kUnorm16 ? 0.5f / 65535.0f + 0x1p-24f : 0x1p-12f;
    EXPECT_GT(baked.report.max_uv_error, 0.0);
    EXPECT_LE(baked.report.max_uv_error, bound);
    EXPECT_LE(baked.report.max_uv_error_texels, baked.report.file.uvs[0].max_error_texels * (1 + 1e-6));
    const Decoded all = decode(file, 0);
    for (size_t i = 0; i < all.positions.size(); ++i) EXPECT_NEAR(all.uvs[i].x, all.positions[i].x, bound + 0.001);
    for (const PageCodec codec : {PageCodec::kFast, PageCodec::kSmall}) {
      config.codec = codec;
      const std::vector<std::byte> paged = bake(scene, config).bytes;
      const BakedFile small = BakedFile::from_bytes(paged);
      EXPECT_TRUE(std::equal(small.bytes().begin(), small.bytes().end(), baked.bytes.begin(), baked.bytes.end()));
    }
  }
}

TEST(BakeScene, HalfFloatCoordinatesAreRefusedOrWarnedOfWhereTheyBreak) {
  Scene scene = masked_scene();
  scene.shapes[0].material = 1;
  BakeConfig config;
  config.uvs = UvEncoding::kFp16;
  EXPECT_TRUE(bake(scene, config).report.warnings.empty()); // a mask of 64 texels
  for (Vec2& uv : scene.meshes[0].uvs) uv *= 40.0f;
  const BakedScene rough = bake(scene, config);
  ASSERT_EQ(rough.report.warnings.size(), 1u);
  EXPECT_NE(rough.report.warnings[0].find("texels off"), std::string::npos);
  EXPECT_TRUE(bake(scene).report.warnings.empty());
  scene.meshes[0].uvs[3].x = 70000.0f;
  EXPECT_THROW(bake(scene, config), Error);
  config.uvs = UvEncoding::kUnorm16;
  EXPECT_THROW(bake(scene, config), Error);
  EXPECT_LE(bake(scene).report.max_uv_error_texels, 1.0 / 32.0);
}

TEST(BakeScene, TextureCoordinatesThatAreNotFiniteAreReplacedWithAWarning) {
  Scene scene = masked_scene();
  scene.shapes[0].material = 1;
  scene.meshes[0].uvs[5].x = std::nanf("");
  const BakedScene baked = bake(scene);
  ASSERT_EQ(baked.report.warnings.size(), 1u);
  EXPECT_NE(baked.report.warnings[0].find("1 texture coordinates are not finite"), std::string::npos);
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
  EXPECT_GT(g.class_clusters[2], 0u); // does not occlude
  EXPECT_GT(g.class_clusters[4], 0u); // masked
}

TEST(BakeScene, CollapsedTrianglesAreKeptAndCounted) {
  Mesh mesh = test::grid_mesh(10);
  mesh.positions.emplace_back(0.5f, 0.5f, 1.0f);
  mesh.positions.emplace_back(0.5f, 0.5f, 1.00001f);
  mesh.triangles.emplace_back(0, 121, 122);
  const BakedScene baked = bake(scene_of(mesh));
  EXPECT_EQ(baked.report.collapsed_triangles, 1u);
  EXPECT_EQ(baked.report.file.triangles, 201u);
}

TEST(BakeScene, NormalsSurviveFlatteningTransforms) {
  const BakedScene baked = bake(scene_of(test::sphere_mesh(10), test::scaling({1, 1, 0})));
  for (const Vec3 n : decode(BakedFile::from_bytes(baked.bytes), 0).normals)
    EXPECT_TRUE(n == Vec3(0) || std::abs(std::abs(n.z) - 1.0f) < 1e-5f); // dropped as flat, or along z
}

TEST(BakeScene, EmptyScenesAndMeshesAreFine) {
  EXPECT_EQ(bake({}).report.file.triangles, 0u);
  Scene scene = scene_of({});
  test::add_shape(scene, test::grid_mesh(2));
  const BakedFile file = BakedFile::from_bytes(bake(scene).bytes);
  EXPECT_EQ(file.geometries()[0].triangle_count, 0u);
  EXPECT_EQ(file.geometries()[1].triangle_count, 8u);
  EXPECT_TRUE(BakedFile::from_bytes(bake({}).bytes).world_bounds().empty());
}

TEST(BakeScene, ScenesThatBreakTheRulesAreRefused) {
  const auto broken = [](auto&& change) {
    Scene scene = masked_scene();
    scene.shapes[0].material = 1;
    scene.meshes[0].normals.assign(scene.meshes[0].positions.size(), Vec3(0, 0, 1));
    change(scene);
    return bake_kind(scene);
  };
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(broken([](Scene& s) { s.meshes[0].positions[3].y = kNan; }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.meshes[0].positions[3].y = HUGE_VALF; }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.meshes[0].normals[3].y = kNan; }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.meshes[0].normals.pop_back(); }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.meshes[0].uvs.pop_back(); }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.meshes[0].triangles[0].x = 169; }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.shapes[0].mesh = 1; }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.shapes[0].material = 9; }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.shapes[0].parent_from_mesh[3].x = kNan; }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.materials[1].alpha_mask = 1; }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.masks[0].words.pop_back(); }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.masks[0].uv_scale.x = kNan; }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.materials[2].albedo.x = 1.5f; }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.cameras.push_back({}), s.cameras[0].width_px = 0; }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.cameras.push_back({}), s.cameras[0].fov_degrees = kNan; }), ErrorKind::kInput);
  EXPECT_EQ(broken([](Scene& s) { s.instances.push_back({0, Affine(1.0f)}); }), ErrorKind::kInput);
}

struct BakedWithProblems {
  BakedScene baked;
  std::vector<Diagnostic> problems;
};

BakedWithProblems bake_reported(const Scene& scene, const BakeConfig& config = {}) {
  Diagnostics diagnostics;
  Progress progress;
  BakedScene baked = bake_to_bytes(scene, config, diagnostics, progress);
  return {std::move(baked), diagnostics.entries()};
}

bool reported(const BakedWithProblems& result, const std::string& message) {
  return std::any_of(result.problems.begin(), result.problems.end(), [&](const Diagnostic& d) {
    return d.severity == Severity::kError && d.message == message + "; it is left out";
  });
}

/// The message of the bake's error; empty where there is none.
std::string strict_message(const Scene& scene) {
  BakeConfig config;
  config.strict = true;
  try {
    (void)bake(scene, config);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    return error.what();
  }
  return {};
}

TEST(BakeScene, InstancesThatLeaveTheFloatRangeAreLeftOutByName) {
  Scene scene = scene_of(test::grid_mesh(2), test::scaling(DVec3(1e30)));
  scene.objects.push_back({"galaxy", std::move(scene.shapes)});
  scene.shapes.clear();
  scene.instances.push_back({0, Affine(test::scaling(DVec3(1e7)))});
  EXPECT_EQ(strict_message(scene), "");
  scene.instances.push_back({0, Affine(test::scaling(DVec3(1e20)))});
  scene.instances.push_back({0, Affine(test::scaling(DVec3(1e6)))});
  const BakedWithProblems result = bake_reported(scene);
  const BakedFile file = BakedFile::from_bytes(result.baked.bytes);
  ASSERT_EQ(file.instances().size(), 3u); // numbers stay
  EXPECT_EQ(file.instances()[0].geometry, file.instances()[2].geometry);
  EXPECT_EQ(file.geometries()[file.instances()[1].geometry].triangle_count, 0u);
  EXPECT_EQ(result.baked.report.left_out, 1u);
  EXPECT_EQ(file.summary().left_out, 1u);
  const std::string what = "an instance of galaxy leaves the float range: its coordinates reach 1e+50";
  EXPECT_TRUE(reported(result, what));
  EXPECT_EQ(strict_message(scene), what);
  scene.instances = {scene.instances[1]}; // nothing is left of the geometry
  EXPECT_EQ(bake(scene).report.file.triangles, 0u);
}

TEST(BakeScene, ShapesThatLeaveTheFloatRangeAreLeftOutByName) {
  Scene scene = scene_of(test::grid_mesh(2));
  Mesh huge = test::sphere_mesh(4, 1e30f);
  huge.name = "sun";
  test::add_shape(scene, huge, test::scaling(DVec3(1e20)));
  test::add_shape(scene, test::grid_mesh(3));
  scene.objects.push_back({"system", {scene.shapes[0], scene.shapes[1]}});
  scene.instances.push_back({0, Affine(1.0f)});
  scene.instances.push_back({0, Affine(test::translation(DVec3(1.0)))});
  Affine beyond(1.0f);
  beyond[3].x = HUGE_VALF;
  scene.instances.push_back({0, beyond});
  scene.shapes[2].parent_from_mesh = test::translation({4, 0, 0});
  EXPECT_EQ(bake_kind(scene), ErrorKind::kInput); // an instance that is not finite is no scene's
  scene.instances.pop_back();
  const BakedWithProblems result = bake_reported(scene);
  const BakedFile file = BakedFile::from_bytes(result.baked.bytes);
  ASSERT_EQ(file.instances().size(), 5u);
  const std::array<uint32_t, 5> triangles = {8, 0, 18, 8, 8};
  for (size_t i = 0; i < 5; ++i)
    EXPECT_EQ(file.geometries()[file.instances()[i].geometry].triangle_count, triangles[i]) << i;
  EXPECT_EQ(result.baked.report.left_out, 2u);
  EXPECT_TRUE(reported(result, "sun leaves the float range: its coordinates reach 1e+50"));
  EXPECT_TRUE(reported(result, "sun of system leaves the float range: its coordinates reach 1e+50"));
  EXPECT_EQ(strict_message(scene), "sun leaves the float range: its coordinates reach 1e+50");
}

TEST(BakeScene, TransformsOfSharedShapesThatNoFloatHoldsAreLeftOut) {
  Scene scene = scene_of(test::sphere_mesh(12, 1e-30f), test::scaling(DVec3(1e39)));
  scene.shapes.push_back(scene.shapes[0]);
  scene.shapes[1].parent_from_mesh = DAffine(1.0);
  const BakedScene baked = bake(scene);
  EXPECT_EQ(baked.report.left_out, 1u);
  EXPECT_GT(baked.report.file.triangles, 0u);
}

TEST(BakeScene, WhatIsLeftAloneStaysOnTheWorldsGrid) {
  Scene scene = scene_of(test::sphere_mesh(12));
  scene.shapes.push_back(scene.shapes[0]);
  scene.shapes[1].parent_from_mesh = test::scaling(DVec3(1e50)); // left out: the other one shares with nobody
  const BakedScene baked = bake(scene);
  EXPECT_EQ(baked.report.left_out, 1u);
  EXPECT_EQ(baked.report.instanced_shapes, 0u);
  EXPECT_NE(BakedFile::from_bytes(baked.bytes).geometries()[0].flags & baked::kWorldSpace, 0u);
}

TEST(BakeScene, LatticesBeyondTheLimitAreAnErrorThatNamesIt) {
  Scene scene = scene_of(test::grid_mesh(4), test::scaling(DVec3(1e30)));
  try {
    (void)bake(scene, precision(PrecisionKind::kAbsolute, 1e-9));
    ADD_FAILURE() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kLimitExceeded);
    EXPECT_NE(std::string(error.what()).find("coordinates up to 1e+30 at a step of 9"), std::string::npos)
        << error.what();
    EXPECT_NE(std::string(error.what()).find("2^55"), std::string::npos);
  }
}

TEST(BakeScene, CancellingStopsTheBake) {
  struct Guard { // cancellation is process-wide and has no way back: this test runs in a process of its own
    static void run() {
      Progress::cancel();
      Diagnostics diagnostics;
      Progress progress;
      try {
        (void)bake_to_bytes(scene_of(test::grid_mesh(4)), {}, diagnostics, progress);
      } catch (const Error& error) {
        std::exit(error.exit_code());
      }
      std::exit(0);
    }
  };
  EXPECT_EXIT(Guard::run(), testing::ExitedWithCode(7), "");
}

} // namespace
} // namespace packtrace
