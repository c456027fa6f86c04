#include "compress/bake/grid/collapsed_triangles.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/compress/bake_checks.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

using test::bake, test::decode, test::precision, test::scene_of;

using Flags = std::vector<uint8_t>;

TEST(CollapsedTriangles, AreaIsExactOverTheWholeLattice) {
  constexpr int64_t kMax = kMaxLattice;
  const LatticePoint far{kMax, kMax, kMax}, near{-kMax, -kMax, -kMax};
  EXPECT_FALSE(has_area(near, {0, 0, 0}, far));
  EXPECT_FALSE(has_area(near, far, {kMax - 1, kMax - 1, kMax - 1}));
  for (size_t axis = 0; axis < 3; ++axis) { // one step beside a line of 2^56 steps, which double cannot resolve
    LatticePoint beside{1, 1, 1};
    beside[axis] += 1;
    EXPECT_TRUE(has_area(near, beside, far));
    EXPECT_TRUE(has_area(far, near, beside));
  }
  EXPECT_TRUE(has_area({kMax, -kMax, 0}, {-kMax, kMax, 0}, {kMax, kMax, 0}));
  EXPECT_FALSE(has_area({1, 2, 3}, {1, 2, 3}, {4, 5, 6}));
}

TEST(CollapsedTriangles, EqualCornersAlwaysGo) {
  const std::vector<LatticePoint> points{{0, 0, 0}, {2, 0, 0}, {0, 2, 0}};
  const std::vector<Triangle> triangles{{0, 1, 2}, {0, 0, 1}, {1, 2, 1}, {2, 2, 2}};
  EXPECT_EQ(find_collapsed(points, triangles), (Flags{0, 1, 1, 1}));
}

/// Points 0, 1, 2 lie on a line in this order; 3 and 4 lie on opposite sides of it.
const std::vector<LatticePoint> kLine{{0, 0, 0}, {3, 0, 0}, {7, 0, 0}, {3, 5, 0}, {4, -5, 0}};

TEST(CollapsedTriangles, SliverBetweenALongEdgeAndTwoShortOnesStays) {
  const std::vector<Triangle> triangles{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 4}};
  EXPECT_EQ(find_collapsed(kLine, triangles), (Flags{0, 0, 0, 0}));
}

TEST(CollapsedTriangles, SliverThatNothingLongAndShortMeetsAtGoes) {
  EXPECT_EQ(find_collapsed(kLine, std::vector<Triangle>{{0, 2, 1}}), (Flags{1}));
  EXPECT_EQ(find_collapsed(kLine, std::vector<Triangle>{{0, 2, 1}, {2, 0, 4}}), (Flags{1, 0})); // at the border
}

TEST(CollapsedTriangles, SliversThatCloseAmongThemselvesGoTogether) {
  // A tube of two slivers with coinciding sides, with triangles at both of its short edges and at its long edge.
  const std::vector<Triangle> triangles{{0, 2, 1}, {0, 1, 2}, {0, 1, 3}, {1, 2, 3}, {2, 0, 4}};
  EXPECT_EQ(find_collapsed(kLine, triangles), (Flags{1, 1, 0, 0, 0}));
}

/// A closed tube along a diagonal; its rings are much narrower than their distance.
Mesh thin_tube(double radius) {
  constexpr uint32_t kRings = 20, kSides = 6;
  Mesh mesh;
  mesh.name = "tube";
  for (uint32_t ring = 0; ring < kRings; ++ring)
    for (uint32_t side = 0; side < kSides; ++side) {
      const double angle = 2.0 * M_PI * side / kSides;
      mesh.positions.emplace_back(ring + radius * std::cos(angle), ring - radius * std::cos(angle),
                                  0.7 * ring + radius * std::sin(angle));
      const uint32_t a = ring * kSides + side, b = ring * kSides + (side + 1) % kSides;
      if (ring + 1 == kRings) continue;
      mesh.triangles.emplace_back(a, b, a + kSides), mesh.triangles.emplace_back(b, b + kSides, a + kSides);
    }
  return mesh;
}

TEST(CollapsedTriangles, AreLeftOutWithTheirPointsAndClustersAndCounted) {
  Scene scene = scene_of(test::grid_mesh(10));
  test::add_shape(scene, thin_tube(1e-4));
  const BakedScene baked = bake(scene, precision(PrecisionKind::kAbsolute, 0.05));
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  EXPECT_EQ(file.geometries()[0].triangle_count, 200u);
  EXPECT_EQ(file.geometries()[1].triangle_count, 0u);
  EXPECT_EQ(file.geometries()[1].cluster_count, 0u);
  EXPECT_EQ(baked.report.file.triangles, 200u);
  EXPECT_EQ(baked.report.collapsed_triangles, 19u * 12u);
  EXPECT_EQ(baked.report.coinciding_triangles, 0u);
  EXPECT_EQ(baked.report.vanished_geometries, 1u);
  const double tube = 6 * 1e-4 * 19.0 * std::sqrt(2.49); // of six sides: about 2 pi r in total
  EXPECT_NEAR(baked.report.collapsed_area, tube, 0.2 * tube);
  EXPECT_NEAR(baked.report.source_area, 1.0 + baked.report.collapsed_area, 1e-6);
  EXPECT_EQ(file.summary().collapsed_triangles, baked.report.collapsed_triangles);
  EXPECT_EQ(file.summary().collapsed_area, baked.report.collapsed_area);
  EXPECT_EQ(file.summary().source_area, baked.report.source_area);
  ASSERT_EQ(baked.report.warnings.size(), 3u); // rough surface, collapsed area, vanished tube
  EXPECT_NE(baked.report.warnings[1].find("228 triangles with "), std::string::npos) << baked.report.warnings[1];
  EXPECT_NE(baked.report.warnings[2].find("nothing is left of 1 geometries"), std::string::npos);
}

TEST(CollapsedTriangles, AreaOfInstancesCountsAsTheyArePlaced) {
  Scene scene = scene_of(test::grid_mesh(4));
  scene.meshes.push_back(thin_tube(1e-4));
  scene.objects.push_back({"tube", {Shape{1, 0, false, DAffine(1.0)}}});
  scene.instances.push_back({0, Affine(1.0f)});
  const BakeConfig config = precision(PrecisionKind::kPositionBits, 8);
  const double once = bake(scene, config).report.collapsed_area;
  scene.instances.push_back({0, Affine(test::scaling(DVec3(3.0)))});
  const BakeReport both = bake(scene, config).report;
  EXPECT_EQ(both.collapsed_triangles, 19u * 12u); // stored once for all instances
  EXPECT_NEAR(both.collapsed_area, 10.0 * once, 1e-5 * once);
}

/// Two plates with the same winding at a distance of 0.001, and one with the opposite winding at the same distance
/// below.
Mesh plates() {
  Mesh mesh;
  const Mesh grid = test::grid_mesh(8);
  for (const float z : {0.0f, 0.001f, -0.001f}) {
    const auto base = static_cast<uint32_t>(mesh.positions.size());
    for (const Vec3& p : grid.positions) mesh.positions.emplace_back(p.x, p.y, p.z + z);
    for (const Triangle& t : grid.triangles)
      mesh.triangles.push_back(z < 0.0f ? Triangle(base) + Triangle(t.x, t.z, t.y) : Triangle(base) + t);
  }
  return mesh;
}

TEST(CoincidingTriangles, AreLeftOutButForTheOppositeSide) {
  const BakedScene fine = bake(scene_of(plates()), precision(PrecisionKind::kAbsolute, 1e-4));
  EXPECT_EQ(fine.report.coinciding_triangles, 0u);
  EXPECT_EQ(fine.report.file.triangles, 3u * 128u);
  const BakedScene coarse = bake(scene_of(plates()), precision(PrecisionKind::kAbsolute, 0.01));
  EXPECT_EQ(coarse.report.coinciding_triangles, 128u);
  EXPECT_EQ(coarse.report.collapsed_triangles, 0u);
  EXPECT_EQ(coarse.report.file.triangles, 2u * 128u);
  EXPECT_EQ(coarse.report.file.bake.coinciding_triangles, 128u);
}

TEST(CoincidingTriangles, WhatTheSourceHasTwiceIsNotTouched) {
  Mesh twice = test::grid_mesh(8, 0.1f);
  const auto count = static_cast<uint32_t>(twice.positions.size());
  // An identical copy of every vertex.
  for (uint32_t i = 0; i < count; ++i) twice.positions.push_back(Vec3(twice.positions[i]));
  for (size_t i = 0; i < 128; ++i) {
    const Triangle t = twice.triangles[i] + Triangle(count);
    twice.triangles.emplace_back(t.y, t.z, t.x);
  }
  twice.uvs.clear();
  for (const double step : {1e-4, 0.01}) {
    const BakedScene baked = bake(scene_of(twice), precision(PrecisionKind::kAbsolute, step));
    EXPECT_EQ(baked.report.coinciding_triangles, 0u);
    EXPECT_EQ(baked.report.file.triangles, 256u);
  }
}

TEST(CollapsedTriangles, SlotsWithoutTrianglesAreClosed) {
  Scene scene;
  for (const char* name : {"glass", "tube", "plate"})
    scene.materials.push_back({name, 0, Vec3(0.5f), kNoMask, kNoMask});
  scene.materials[0].flags = kTransmissive; // a separate material class
  scene.meshes = {thin_tube(1e-4), test::grid_mesh(10), test::sphere_mesh(8)};
  scene.objects.push_back({"all",
                           {Shape{0, 1, false, DAffine(1.0)}, Shape{1, 2, false, DAffine(1.0)},
                            Shape{2, 0, false, test::translation({3, 0, 0})}}});
  scene.objects.push_back({"tube", {Shape{0, 1, false, DAffine(1.0)}}});
  for (uint32_t object : {0u, 1u, 0u}) scene.instances.push_back({object, Affine(1.0f)});
  const BakedScene baked = bake(scene, precision(PrecisionKind::kAbsolute, 0.05));
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  ASSERT_EQ(file.instances().size(), 3u);
  for (const uint32_t instance : {0u, 2u}) {
    const uint32_t g = file.instances()[instance].geometry;
    const std::span<const uint32_t> materials = file.instance_materials(instance);
    ASSERT_EQ(materials.size(), 2u);
    const test::Decoded all = decode(file, g);
    for (size_t i = 0; i < all.triangles.size(); ++i) // only the sphere lies at x > 1.5
      EXPECT_EQ(file.materials()[materials[all.slots[i]]].name,
                all.positions[all.triangles[i].x].x > 1.5f ? "glass" : "plate");
  }
  EXPECT_TRUE(file.instance_materials(1).empty());
}

TEST(CollapsedTriangles, LevelsAreBuiltOfWhatIsLeft) {
  BakeConfig config = precision(PrecisionKind::kPositionBits, 5);
  config.lod = LodUse::kAll;
  const BakedScene baked = bake(scene_of(test::sphere_mesh(60)), config);
  EXPECT_GT(baked.report.collapsed_triangles + baked.report.coinciding_triangles, 0u);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  EXPECT_GE(file.lod(0).levels.size(), 3u);
  EXPECT_EQ(file.lod(0).levels[0].triangles, file.geometries()[0].triangle_count);
  config.precision = 1; // a lattice of eight points leaves too few triangles for levels
  EXPECT_EQ(bake(scene_of(test::sphere_mesh(60)), config).report.lod_geometries, 0u);
}

/// Displaces the vertices randomly by up to a fraction of the first edge, so that no lattice fits the mesh particularly
/// well.
Mesh shaken(Mesh mesh, float fraction) {
  test::Random random(7);
  const float by = fraction * glm::length(mesh.positions[mesh.triangles[0].y] - mesh.positions[mesh.triangles[0].x]);
  for (Vec3& p : mesh.positions)
    for (int axis = 0; axis < 3; ++axis) p[axis] += random.uniform(-by, by);
  return mesh;
}

TEST(CollapsedTriangles, FewerBitsMakeSmallerFiles) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  for (const auto& [name, mesh] : {std::pair("sphere", shaken(test::sphere_mesh(60), 0.2f)),
                                   {"bumps", shaken(test::grid_mesh(64, 0.1f, true), 0.2f)},
                                   {"plane", shaken(test::grid_mesh(64), 0.2f)},
                                   {"soup", test::soup_mesh(3000, 5)}})
    for (const PageCodec codec : {PageCodec::kNone, PageCodec::kFast, PageCodec::kSmall}) {
      size_t last = 0;
      for (int bits = 6; bits <= 24; bits += 2) {
        BakeConfig config = precision(PrecisionKind::kPositionBits, bits);
        config.codec = codec;
        const size_t bytes = bake(scene_of(mesh), config).bytes.size();
        EXPECT_GE(bytes, last) << name << ", " << name_of(codec) << ", " << bits << " bits";
        last = bytes;
      }
    }
}

} // namespace
} // namespace packtrace
