// The default precision suffices for rendering a scene whatever its range of scales.

#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "compress/bake/grid/outline_share.h"
#include "compress/bake/grid/view_measure.h"
#include "tests/compress/bake_checks.h"
#include "tests/compress/precision_scenes.h"

namespace packtrace {
namespace {

using test::add_instance;
using test::add_object;
using test::bake;
using test::camera_at;
using test::Decoded;
using test::floor_mesh;
using test::Random;
using test::step_of;

/// An open tube of 2 x 12 triangles from a to b.
void add_tube(Mesh& mesh, DVec3 a, DVec3 b, double radius) {
  constexpr uint32_t kSides = 12;
  const DVec3 along = glm::normalize(b - a), x = glm::normalize(glm::cross(along, DVec3(0.0, 1.0, 0.1))),
              y = glm::cross(along, x);
  const auto first = static_cast<uint32_t>(mesh.positions.size());
  for (const DVec3 end : {a, b})
    for (uint32_t i = 0; i < kSides; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / kSides;
      mesh.positions.emplace_back(end + radius * (std::cos(angle) * x + std::sin(angle) * y));
    }
  for (uint32_t i = 0; i < kSides; ++i) {
    const uint32_t p = first + i, q = first + (i + 1) % kSides;
    mesh.triangles.emplace_back(p, q, p + kSides);
    mesh.triangles.emplace_back(q, q + kSides, p + kSides);
  }
}

/// Tubes of radius 0.01 and length 20.
Mesh tubes_mesh(uint32_t count) {
  Mesh mesh;
  mesh.name = "tubes";
  Random random(7);
  for (uint32_t i = 0; i < count; ++i) {
    const double y = random.uniform(0.1f, 2.0f), z = random.uniform(-8.0f, 8.0f);
    add_tube(mesh, {-10, y, z}, {10, y + random.uniform(-0.3f, 0.3f), z + random.uniform(-0.5f, 0.5f)}, 0.01);
  }
  return mesh;
}

/// Two instances of a unit sphere on a floor 1000 units wide.
Scene spheres_on_a_floor(DVec3 place = DVec3(0.0)) {
  Scene scene = test::scene_of(floor_mesh(500.0f, -1.0f), test::translation(place));
  add_object(scene, "sphere", test::sphere_mesh(24));
  add_instance(scene, 0, test::translation(place + DVec3(-1.2, 0, 0)));
  add_instance(scene, 0, test::translation(place + DVec3(1.2, 0, 0)));
  scene.cameras.push_back(camera_at(place + DVec3(6, 3, -8), place));
  return scene;
}

Scene tubes_scene() {
  Scene scene = test::scene_of(tubes_mesh(60));
  test::add_shape(scene, floor_mesh(12.0f, 0.0f));
  scene.cameras.push_back(camera_at({12, 8, -18}, {0, 1, 0}));
  return scene;
}

/// Largest angle between corresponding facets of the source and of geometry 0, which must contain all triangles.
double largest_tilt_degrees(const BakedFile& file, const Mesh& mesh) {
  const double step = step_of(file.geometries()[0]);
  double worst = 0.0;
  for (const Triangle& t : mesh.triangles) {
    std::array<DVec3, 3> source, lattice;
    for (int corner = 0; corner < 3; ++corner) {
      const auto i = static_cast<size_t>(corner);
      source[i] = DVec3(mesh.positions[t[corner]]);
      for (int axis = 0; axis < 3; ++axis) lattice[i][axis] = static_cast<double>(to_lattice(source[i][axis], step));
    }
    const DVec3 a = glm::normalize(glm::cross(source[1] - source[0], source[2] - source[0]));
    const DVec3 b = glm::normalize(glm::cross(lattice[1] - lattice[0], lattice[2] - lattice[0]));
    worst = std::max(worst, 57.29577951308232 * std::acos(std::min(1.0, glm::dot(a, b))));
  }
  return worst;
}

TEST(DefaultPrecision, AFloorStaysUnderTheSmallThingsOnIt) {
  for (const DVec3 place : {DVec3(0.0), DVec3(4e6, 0.0, 4e6)}) {
    const BakedScene baked = bake(spheres_on_a_floor(place));
    const BakedFile file = BakedFile::from_bytes(baked.bytes);
    for (const Vec3 p : test::decode(file, 0).positions) EXPECT_NEAR(p.y, -1.0, 0.005);
    EXPECT_GE(baked.report.finer_geometries, 1u);
    EXPECT_TRUE(baked.report.promise.empty());
  }
}

TEST(DefaultPrecision, LongThinTubesKeepTheirShape) {
  const Scene scene = tubes_scene();
  const BakedScene baked = bake(scene);
  EXPECT_EQ(baked.report.collapsed_triangles, 0u);
  EXPECT_LT(largest_tilt_degrees(BakedFile::from_bytes(baked.bytes), scene.meshes[0]), 5.0);
  EXPECT_TRUE(baked.report.promise.empty());
}

TEST(DefaultPrecision, ManyShapesThatCoverLittleEachCountTogether) {
  Scene scene = test::scene_of(floor_mesh(12.0f, 0.0f));
  for (uint32_t i = 0; i < 60; ++i) {
    Mesh mesh;
    Random random(i);
    add_tube(mesh, {-10, random.uniform(0.1f, 2.0f), -6 + 0.2 * i}, {10, 1.0, -6 + 0.2 * i}, 0.01);
    test::add_shape(scene, mesh);
  }
  scene.cameras.push_back(camera_at({12, 8, -18}, {0, 1, 0}));
  const BakedScene baked = bake(scene);
  EXPECT_EQ(baked.report.collapsed_triangles, 0u);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  for (uint32_t g = 1; g < file.geometries().size(); ++g) EXPECT_LT(step_of(file.geometries()[g]), 0.001);
}

TEST(DefaultPrecision, ANearViewNeedsAFinerGrid) {
  Scene scene = test::scene_of(test::grid_mesh(8, 0.2f), test::scaling(DVec3(100.0)));
  const double from_afar = bake(scene).report.world_step;
  scene.cameras.push_back(camera_at({50, 50, -0.2}, {50, 50, 0}));
  const BakedFile file = BakedFile::from_bytes(bake(scene).bytes);
  EXPECT_LT(step_of(file.geometries()[0]), 0.5 * from_afar);
}

TEST(DefaultPrecision, WellShapedTrianglesSeenWholeKeepTheFractionOfTheirEdges) {
  const BakedScene baked = bake(test::scene_of(test::sphere_mesh(60)));
  EXPECT_EQ(baked.report.finer_geometries, 0u);
  EXPECT_EQ(step_of(BakedFile::from_bytes(baked.bytes).geometries()[0]), baked.report.world_step);
}

TEST(DefaultPrecision, WhoAsksForAPrecisionGetsJustThatAndHearsWhatItLoses) {
  const Scene scene = tubes_scene();
  for (const BakeConfig& config :
       {test::precision(PrecisionKind::kAbsolute, 0.1), test::precision(PrecisionKind::kPositionBits, 8.0),
        test::precision(PrecisionKind::kDiagonalFraction, 1e-3)}) {
    const BakedScene baked = bake(scene, config);
    const BakedFile file = BakedFile::from_bytes(baked.bytes);
    EXPECT_EQ(step_of(file.geometries()[0]), baked.report.world_step);
    EXPECT_EQ(baked.report.finer_geometries, 0u);
    ASSERT_FALSE(baked.report.promise.empty());
    EXPECT_EQ(baked.report.promise[0].name, "tubes");
    EXPECT_EQ(baked.report.promise[0].bound, "height");
    EXPECT_LT(baked.report.promise[0].wanted, 0.001);
  }
  EXPECT_TRUE(bake(scene, test::precision(PrecisionKind::kAbsolute, 1e-5)).report.promise.empty());
}

TEST(DefaultPrecision, GeometriesOnTwoGridsAgreeWhereTheyTouch) {
  // A strip of slivers between two patches of well-shaped triangles.
  const auto patch = [](uint32_t rows, float x0) {
    Mesh mesh;
    for (uint32_t row = 0; row <= rows; ++row)
      for (uint32_t column = 0; column <= 8; ++column) {
        const float u = x0 + static_cast<float>(column) / 8.0f, v = static_cast<float>(row) / static_cast<float>(rows);
        mesh.positions.emplace_back(u, 0.1f * std::sin(3.0f * u + 2.0f * v), v);
      }
    for (uint32_t row = 0; row < rows; ++row)
      for (uint32_t column = 0; column < 8; ++column) {
        const uint32_t a = row * 9 + column;
        mesh.triangles.emplace_back(a, a + 9, a + 1);
        mesh.triangles.emplace_back(a + 1, a + 9, a + 10);
      }
    return mesh;
  };
  Scene scene = test::scene_of(patch(8, 0.0f));
  test::add_shape(scene, patch(512, 1.0f));
  test::add_shape(scene, patch(8, 2.0f));
  scene.cameras.push_back(camera_at({1.5, 3, -2}, {1.5, 0, 0.5}));
  const BakedFile file = BakedFile::from_bytes(bake(scene).bytes);
  ASSERT_LT(step_of(file.geometries()[1]), step_of(file.geometries()[0]));
  for (const uint32_t coarse : {0u, 2u}) {
    std::map<std::array<float, 3>, int> seen;
    for (const Vec3 p : test::decode(file, coarse).positions) seen[{p.x, p.y, p.z}] |= 1;
    for (const Vec3 p : test::decode(file, 1).positions) seen[{p.x, p.y, p.z}] |= 2;
    size_t common = 0;
    for (const auto& [place, uses] : seen) common += uses == 3;
    EXPECT_EQ(common, 9u); // vertices of the coarser side
  }
}

TEST(DefaultPrecision, BytesDoNotDependOnTheNumberOfThreads) {
  Scene scene = tubes_scene();
  add_object(scene, "sphere", test::sphere_mesh(12, 0.2f));
  for (int i = 0; i < 400; ++i) add_instance(scene, 0, test::translation({0.05 * i - 10, 0.2, 0.01 * i}));
  const std::vector<std::byte> bytes = bake(scene).bytes;
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(bake(scene).bytes, bytes);
}

TEST(DefaultPrecision, CamerasWithoutRaysAndBoxesBeyondFloatsAreNoHindrance) {
  Scene scene = spheres_on_a_floor();
  scene.cameras.push_back(Camera{});
  scene.cameras.back().fov_degrees = 0.0;
  scene.cameras.push_back(Camera{});
  scene.cameras.back().world_from_camera = DAffine(0.0);
  add_instance(scene, 0, compose(test::translation({3e38, 3e38, 0}), test::scaling(DVec3(1e38))));
  const BakedScene baked = bake(scene);
  EXPECT_EQ(baked.report.left_out, 1u);
  for (const Vec3 p : test::decode(BakedFile::from_bytes(baked.bytes), 0).positions) EXPECT_NEAR(p.y, -1.0, 0.005);
}

std::vector<SampleTriangle> sample_of(const Scene& scene, size_t max_count) {
  return sample_surface(scene, plan_scene(scene).geometries[0], max_count);
}

TEST(SurfaceSample, EstimatesSumsOverAllTriangles) {
  Mesh mesh = test::grid_mesh(150, 0.3f);
  const auto first = static_cast<uint32_t>(mesh.positions.size());
  for (const Vec3 p : {Vec3(0, 0, 5), Vec3(100, 0, 5), Vec3(0, 100, 5)}) mesh.positions.push_back(p);
  mesh.triangles.emplace_back(first, first + 1, first + 2); // it has most of the area
  const Scene scene = test::scene_of(mesh);
  const std::vector<SampleTriangle> all = sample_of(scene, 1 << 20), some = sample_of(scene, 2000);
  ASSERT_EQ(all.size(), mesh.triangles.size());
  EXPECT_LE(some.size(), 2001u);
  const auto sum = [](const std::vector<SampleTriangle>& sample, const auto& value) {
    double total = 0.0;
    for (const SampleTriangle& t : sample) total += t.weight * value(t.corners);
    return total;
  };
  const auto count = [](const DTriangle&) { return 1.0; };
  EXPECT_NEAR(sum(some, area_of), sum(all, area_of), 0.01 * sum(all, area_of));
  EXPECT_NEAR(sum(some, count), sum(all, count), 0.05 * sum(all, count));
  EXPECT_NEAR(sum(some, longest_edge_of), sum(all, longest_edge_of), 0.05 * sum(all, longest_edge_of));
}

ViewStats look(const Scene& scene, const Camera& camera) {
  const std::vector<SampleTriangle> sample = sample_of(scene, 8192);
  std::vector<double> pixels(sample.size());
  const ScenePlan plan = plan_scene(scene);
  const std::vector<uint32_t> instances{0};
  const Bounds box = bounds_of(scene.meshes[0].positions);
  ViewSums sums;
  add_geometry_view(PrimaryCamera(camera, kPromisedSize), sample, {plan.instances, instances}, box, sums, pixels);
  return sums.stats();
}

TEST(ViewMeasure, AWallAheadCoversTheImage) {
  Mesh wall = floor_mesh(1000.0f, 0.0f);
  for (Vec3& p : wall.positions) p = Vec3(p.x, p.z, 10.0f);
  const Camera camera = camera_at({0, 0, 0}, {0, 0, 1});
  const ViewStats stats = look(test::scene_of(wall), camera);
  const double pixel = 10.0 * PrimaryCamera(camera, kPromisedSize).pixel_spread();
  EXPECT_NEAR(stats.pixels, static_cast<double>(kPromisedSize.pixels()), 0.08 * stats.pixels);
  EXPECT_NEAR(stats.pixel, pixel, 0.2 * pixel);
  EXPECT_NEAR(stats.height, 1000.0 * std::sqrt(2.0), 1.0);
}

TEST(ViewMeasure, WhatIsBehindOrBesideTheCameraCoversNothing) {
  const Scene scene = test::scene_of(test::sphere_mesh(12));
  EXPECT_EQ(look(scene, camera_at({0, 0, -5}, {0, 0, -10})).pixels, 0.0);
  EXPECT_EQ(look(scene, camera_at({0, 0, -5}, {20, 0, -5})).pixels, 0.0);
  const double ahead = look(scene, camera_at({0, 0, -5}, {0, 0, 0})).pixels;
  Camera around = camera_at({0, 0, -5}, {0, 0, 0});
  EXPECT_GT(ahead, 2.0 * std::numbers::pi * 35 * 35); // front and back
  around.projection = Projection::kEnvironment;
  EXPECT_GT(look(scene, around).pixels, 100.0);
}

TEST(ViewMeasure, AFloorThroughTheEyeTakesBoundedTime) {
  const ViewStats stats = look(test::scene_of(floor_mesh(1e6f, 0.0f)), camera_at({0, 0, 0}, {0, -0.2, 1}));
  EXPECT_TRUE(std::isfinite(stats.pixels));
}

double outline_of(const Mesh& mesh) {
  const Scene scene = test::scene_of(mesh);
  return outline_share(scene, plan_scene(scene).geometries[0]);
}

TEST(OutlineShare, TellsLooseTrianglesFromSurfaces) {
  EXPECT_EQ(outline_of(test::soup_mesh(500, 3)), 1.0);
  EXPECT_LT(outline_of(test::sphere_mesh(40)), 0.04);
  EXPECT_NEAR(outline_of(floor_mesh(1.0f, 0.0f)), 8.0 / (8.0 + std::sqrt(8.0)), 1e-6); // all edges but the diagonal
  Mesh apart; // a sphere whose triangles share no vertices
  const Mesh sphere = test::sphere_mesh(40);
  for (const Triangle& t : sphere.triangles) {
    const auto first = static_cast<uint32_t>(apart.positions.size());
    for (int corner = 0; corner < 3; ++corner) apart.positions.push_back(sphere.positions[t[corner]]);
    apart.triangles.emplace_back(first, first + 1, first + 2);
  }
  EXPECT_NEAR(outline_of(apart), outline_of(sphere), 0.01);
}

} // namespace
} // namespace packtrace
