#include "compress/bake/lod/simplify/simplify.h"

#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "compress/bake/lod/bound/surface_bound.h"
#include "compress/bake/lod/bound/triangle_distance.h"
#include "compress/bake/lod/loose_pieces.h"
#include "compress/bake/lod/simplify/quadric.h"
#include "tests/compress/lod/lod_class_meshes.h"
#include "tests/compress/lod/lod_meshes.h"
#include "tests/compress/test_scenes.h"

namespace packtrace::test {
namespace {

constexpr std::array<uint32_t, 1> kOneSeam = {0};

SimplifyMesh whole_number_mesh(const Mesh& mesh, double scale) {
  SimplifyMesh out;
  for (const Vec3& p : mesh.positions) out.points.push_back(glm::round(DVec3(p) * scale));
  out.locked.assign(out.points.size(), 0);
  for (const Triangle& t : mesh.triangles) out.triangles.push_back({t, Triangle(Wedge::kNone), 0, 0.0});
  return out;
}

SimplifyConfig to(uint32_t triangles) {
  SimplifyConfig config;
  config.target_triangles = triangles;
  config.seam_of_kind = kOneSeam;
  return config;
}

TEST(Simplify, ReachesTheTarget) {
  SimplifyMesh mesh = whole_number_mesh(torus_mesh(80, 40), 1e5);
  simplify(mesh, to(1000));
  EXPECT_LE(mesh.triangles.size(), 1000u);
  EXPECT_GE(mesh.triangles.size(), 998u);
}

TEST(Simplify, LeavesWhatIsSmallEnough) {
  SimplifyMesh mesh = whole_number_mesh(torus_mesh(20, 10), 1e5);
  const size_t before = mesh.triangles.size();
  simplify(mesh, to(400));
  EXPECT_EQ(mesh.triangles.size(), before);
}

TEST(Simplify, LockedPointsStay) {
  SimplifyMesh mesh = whole_number_mesh(torus_mesh(60, 40), 1e5);
  const std::vector<DVec3> before = mesh.points;
  for (size_t i = 0; i < mesh.locked.size(); i += 3) mesh.locked[i] = 1;
  simplify(mesh, to(10));
  std::vector<uint8_t> used(before.size());
  for (const LodTriangle& t : mesh.triangles)
    for (int i = 0; i < 3; ++i) used[t.points[i]] = 1;
  for (size_t i = 0; i < before.size(); i += 3) {
    EXPECT_EQ(mesh.points[i], before[i]);
    EXPECT_EQ(used[i], 1);
  }
}

TEST(Simplify, PointsStayOnWholeNumbersAndInTheBox) {
  SimplifyMesh mesh = whole_number_mesh(sphere_mesh(40), 1e4);
  simplify(mesh, to(300));
  ASSERT_LE(mesh.triangles.size(), 300u);
  ASSERT_FALSE(mesh.triangles.empty());
  for (const DVec3& p : mesh.points) {
    EXPECT_EQ(p, glm::round(p));
    EXPECT_LE(std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}), 1e4);
  }
}

TEST(Simplify, AFlatPlaneStaysFlatAndWhole) {
  SimplifyMesh mesh = whole_number_mesh(grid_mesh(32), 3200.0);
  const std::vector<DVec3> points = mesh.points;
  const std::vector<LodTriangle> triangles = mesh.triangles;
  simplify(mesh, to(2));
  EXPECT_LE(mesh.triangles.size(), 6u);
  bound_errors(points, triangles, mesh);
  double area = 0.0;
  for (const LodTriangle& t : mesh.triangles) {
    EXPECT_LT(t.error, 1e-6);
    area += glm::length(glm::cross(mesh.points[t.points.y] - mesh.points[t.points.x],
                                   mesh.points[t.points.z] - mesh.points[t.points.x]));
  }
  EXPECT_DOUBLE_EQ(area, 2.0 * 3200.0 * 3200.0);
}

/// Flat faces must not use up triangles that rims need.
TEST(Simplify, AThinPlateStaysExact) {
  for (const double thickness : {1e-2, 1e-3}) {
    SimplifyMesh mesh = whole_number_mesh(plate_mesh(40, thickness, 0.0), 1e5);
    const std::vector<DVec3> points = mesh.points;
    const std::vector<LodTriangle> triangles = mesh.triangles;
    simplify(mesh, to(100));
    EXPECT_LE(mesh.triangles.size(), 100u);
    bound_errors(points, triangles, mesh);
    double largest = 0.0;
    for (const LodTriangle& t : mesh.triangles) largest = std::max(largest, t.error);
    EXPECT_LE(largest, 2.0) << "thickness " << thickness; // rounding moves the points of sides that are not whole
  }
}

/// Maximum distance of the points from the mesh's surface.
double farthest_from(const std::vector<DVec3>& points, const SimplifyMesh& mesh) {
  double farthest = 0.0;
  for (const DVec3& p : points) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const LodTriangle& t : mesh.triangles)
      nearest = std::min(nearest, glm::length(p - nearest_point(p, mesh.points[t.points.x], mesh.points[t.points.y],
                                                                mesh.points[t.points.z])));
    farthest = std::max(farthest, nearest);
  }
  return farthest;
}

/// No plane of a thin part's triangles keeps its tip from receding along it.
TEST(Simplify, TipsOfThinPartsStay) {
  constexpr uint32_t kFins = 60, kSteps = 20;
  SimplifyMesh mesh = whole_number_mesh(fins_mesh(kFins, kSteps, 7), 1e4);
  std::vector<DVec3> tips;
  for (uint32_t i = 1; i <= kFins; ++i) tips.push_back(mesh.points[i * (3 * kSteps + 1) - 1]);
  simplify(mesh, to(kFins * 10));
  EXPECT_LE(mesh.triangles.size(), kFins * 10);
  EXPECT_LE(farthest_from(tips, mesh), 350.0); // 3.5 % of a long fin; 528 where tips recede
}

/// The sides of a polygon, made of triangles with collinear corners.
TEST(Simplify, LinesOfThreePointsKeepTheirShape) {
  constexpr uint32_t kSides = 16, kCut = 8;
  constexpr double kRadius = 1e5;
  SimplifyMesh mesh;
  const auto corner = [](uint32_t i) {
    const double angle = 2.0 * M_PI * i / kSides;
    return static_cast<double>(kCut) * glm::round(kRadius / kCut * DVec3(std::cos(angle), std::sin(angle), 0.0));
  };
  for (uint32_t side = 0; side < kSides; ++side)
    for (uint32_t i = 0; i < kCut; ++i) {
      const uint32_t first = side * kCut + i;
      mesh.points.push_back(corner(side) + (corner(side + 1) - corner(side)) * (i / static_cast<double>(kCut)));
      if (i + 2 <= kCut)
        mesh.triangles.push_back(
            {Triangle(first, first + 1, (first + 2) % (kSides * kCut)), Triangle(Wedge::kNone), 0, 0.0});
    }
  mesh.locked.assign(mesh.points.size(), 0);
  const std::vector<DVec3> points = mesh.points;
  simplify(mesh, to(static_cast<uint32_t>(mesh.triangles.size() / 2)));
  EXPECT_LT(farthest_from(points, mesh), 0.02 * kRadius);
}

/// A closed surface of revolution around the x axis, of rings between two end points.
SimplifyMesh turned(const std::vector<std::pair<double, double>>& x_and_radius, uint32_t around) {
  SimplifyMesh mesh;
  for (const auto& [x, radius] : x_and_radius)
    for (uint32_t i = 0; i < around; ++i) {
      const double angle = 2.0 * M_PI * i / around;
      mesh.points.push_back(glm::round(DVec3(x, radius * std::cos(angle), radius * std::sin(angle))));
    }
  const auto rings = static_cast<uint32_t>(x_and_radius.size());
  const auto add = [&](uint32_t a, uint32_t b, uint32_t c) {
    mesh.triangles.push_back({Triangle(a, b, c), Triangle(Wedge::kNone), 0, 0.0});
  };
  for (uint32_t ring = 0; ring + 1 < rings; ++ring)
    for (uint32_t i = 0; i < around; ++i) {
      const uint32_t a = ring * around + i, b = ring * around + (i + 1) % around;
      add(a, a + around, b), add(b, a + around, b + around);
    }
  for (uint32_t i = 2; i < around; ++i) {
    const uint32_t last = (rings - 1) * around;
    add(0, i - 1, i), add(last, last + i, last + i - 1);
  }
  mesh.locked.assign(mesh.points.size(), 0);
  return mesh;
}

TEST(Simplify, AHoleMayClose) {
  SimplifyMesh mesh = whole_number_mesh(torus_mesh(60, 24), 1e5);
  simplify(mesh, to(8)); // a torus needs 14
  EXPECT_LE(mesh.triangles.size(), 8u);
}

TEST(Simplify, AThinBridgeStays) {
  std::vector<std::pair<double, double>> rings; // two balls connected by a rod
  constexpr double kBall = 3000.0, kRod = 20.0, kLength = 40000.0;
  for (int i = 1; i < 20; ++i)
    rings.emplace_back(-kBall * std::cos(M_PI * i / 20), std::max(kRod, kBall * std::sin(M_PI * i / 20)));
  for (int i = 1; i < 40; ++i) rings.emplace_back(kBall + (kLength - 2.0 * kBall) * i / 40, kRod);
  for (int i = 1; i < 20; ++i)
    rings.emplace_back(kLength - kBall * std::cos(M_PI * i / 20), std::max(kRod, kBall * std::sin(M_PI * i / 20)));
  SimplifyMesh mesh = turned(rings, 12);
  const std::vector<DVec3> points = mesh.points;
  simplify(mesh, to(40));
  EXPECT_LE(mesh.triangles.size(), 40u);
  EXPECT_LT(farthest_from(points, mesh), 0.5 * kBall);
}

/// Triangles connected at points only: each is the only connection between its corners.
TEST(Simplify, AChainOfTrianglesGetsShorter) {
  SimplifyMesh mesh;
  for (uint32_t i = 0; i < 64; ++i) {
    mesh.points.emplace_back(100.0 * i, 0.0, 0.0);
    mesh.points.emplace_back(100.0 * i + 50.0, 80.0, 0.0);
    mesh.triangles.push_back({Triangle(2 * i, 2 * i + 2, 2 * i + 1), Triangle(Wedge::kNone), 0, 0.0});
  }
  mesh.points.emplace_back(6400.0, 0.0, 0.0);
  mesh.locked.assign(mesh.points.size(), 0);
  simplify(mesh, to(32));
  EXPECT_LE(mesh.triangles.size(), 32u);
}

TEST(Quadric, OfALineIsTheSquaredDistanceFromIt) {
  const DVec3 along = glm::normalize(DVec3(1.0, 2.0, -2.0)), from(3.0, -1.0, 5.0);
  Quadric q;
  q.add_line(along, from, 2.5);
  for (const DVec3 p : {DVec3(0.0), DVec3(7.0, 1.0, 2.0), from + 4.0 * along}) {
    const double value = q.xx * p.x * p.x + q.yy * p.y * p.y + q.zz * p.z * p.z +
                         2.0 * (q.xy * p.x * p.y + q.xz * p.x * p.z + q.yz * p.y * p.z) +
                         2.0 * (q.bx * p.x + q.by * p.y + q.bz * p.z) + q.c;
    const DVec3 off = glm::cross(p - from, along);
    EXPECT_NEAR(value, 2.5 * glm::dot(off, off), 1e-9);
  }
}

TEST(Simplify, MaterialSeamsStay) {
  SimplifyMesh mesh = whole_number_mesh(grid_mesh(32), 3200.0); // left half of one material, right half of another
  for (LodTriangle& t : mesh.triangles) {
    double x = 0.0;
    for (int i = 0; i < 3; ++i) x += mesh.points[t.points[i]].x / 3.0;
    t.kind = x > 1600.0;
  }
  const std::array<uint32_t, 2> seams = {0, 1};
  SimplifyConfig config = to(60);
  config.seam_of_kind = seams;
  simplify(mesh, config);
  EXPECT_TRUE(std::ranges::any_of(mesh.triangles, [](const LodTriangle& t) { return t.kind == 0; }));
  EXPECT_TRUE(std::ranges::any_of(mesh.triangles, [](const LodTriangle& t) { return t.kind == 1; }));
  for (const LodTriangle& t : mesh.triangles)
    for (int i = 0; i < 3; ++i) {
      const double side = t.kind == 0 ? -1.0 : 1.0;
      EXPECT_GE(side * (mesh.points[t.points[i]].x - 1600.0), 0.0);
    }
}

TEST(Simplify, WedgesOfOnePointStayApart) {
  const Mesh faceted = half_faceted(torus_mesh(40, 20));
  SimplifyMesh mesh = whole_number_mesh(torus_mesh(40, 20), 1e5);
  for (size_t i = 0; i < mesh.triangles.size(); ++i) { // each triangle gets its own normal
    const auto wedge = static_cast<uint32_t>(mesh.wedges.size());
    mesh.wedges.push_back({glm::normalize(DVec3(faceted.normals[i % faceted.normals.size()])), wedge});
    mesh.triangles[i].wedges = Triangle(wedge);
  }
  simplify(mesh, to(400));
  EXPECT_LE(mesh.triangles.size(), 400u);
  for (const LodTriangle& t : mesh.triangles)
    for (int i = 0; i < 3; ++i) {
      ASSERT_LT(t.wedges[i], mesh.wedges.size());
      EXPECT_NEAR(glm::length(mesh.wedges[t.wedges[i]].normal), 1.0, 1e-9);
    }
}

TEST(LoosePieces, GoNearestFirstAndCountTheirDistance) {
  SimplifyMesh mesh; // five small triangles on a line, at 0, 10, 30, 70, 150
  for (const double x : {0.0, 10.0, 30.0, 70.0, 150.0}) {
    const auto first = static_cast<uint32_t>(mesh.points.size());
    for (const DVec3& p : {DVec3(x, 0, 0), DVec3(x, 1, 0), DVec3(x, 0, 1)}) mesh.points.push_back(p);
    mesh.triangles.push_back({Triangle(first, first + 1, first + 2), Triangle(Wedge::kNone), 0, 0.0});
  }
  mesh.locked.assign(mesh.points.size(), 0);
  drop_loose_pieces(mesh, {3, 3});
  ASSERT_EQ(mesh.triangles.size(), 3u);
  double largest = 0.0;
  for (const LodTriangle& t : mesh.triangles) largest = std::max(largest, t.error);
  EXPECT_GE(largest, 10.0);
  EXPECT_LE(largest, 31.0);
  drop_loose_pieces(mesh, {});
  EXPECT_EQ(mesh.triangles.size(), 1u);
}

TEST(LoosePieces, DearOnesStayIfEnoughGo) {
  SimplifyMesh mesh; // pairs of triangles at distance 1, pairs at distance 100
  for (int pair = 0; pair < 4; ++pair)
    for (const double x : {100.0 * pair, 100.0 * pair + 1.0}) {
      const auto first = static_cast<uint32_t>(mesh.points.size());
      for (const DVec3& p : {DVec3(x, 0, 0), DVec3(x, 1, 0), DVec3(x, 0, 1)}) mesh.points.push_back(p);
      mesh.triangles.push_back({Triangle(first, first + 1, first + 2), Triangle(Wedge::kNone), 0, 0.5});
    }
  mesh.locked.assign(mesh.points.size(), 0);
  drop_loose_pieces(mesh, {1, 6}); // pieces at distance 1 cost 1.5, which is three times the largest error
  ASSERT_EQ(mesh.triangles.size(), 4u);
  for (const LodTriangle& t : mesh.triangles) EXPECT_DOUBLE_EQ(t.error, 1.5);
  drop_loose_pieces(mesh, {1, 3}); // target 3: expensive pieces must go too
  ASSERT_EQ(mesh.triangles.size(), 3u);
}

TEST(LoosePieces, LockedOnesStay) {
  SimplifyMesh mesh = whole_number_mesh(tetrahedra_mesh(20, 9), 1e5);
  for (size_t i = 0; i < mesh.locked.size(); i += 4) mesh.locked[i] = 1;
  drop_loose_pieces(mesh, {});
  EXPECT_EQ(mesh.triangles.size(), 80u);
}

TEST(NearestPoint, IsNearestOfManyPointsOfTheTriangle) {
  Random random(3);
  const auto point = [&] { return DVec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)); };
  for (int repeat = 0; repeat < 2000; ++repeat) {
    const DVec3 a = point(), b = point(), c = repeat % 10 == 0 ? a + 0.5 * (b - a) : point(), p = 2.0 * point();
    const double found = glm::length(p - nearest_point(p, a, b, c));
    double least = 1e300;
    constexpr int kSteps = 40;
    for (int i = 0; i <= kSteps; ++i)
      for (int k = 0; k <= kSteps - i; ++k)
        least = std::min(least, glm::length(p - (a + (b - a) * (i / double{kSteps}) + (c - a) * (k / double{kSteps}))));
    EXPECT_LE(found, least + 1e-9);
    EXPECT_GE(found, least - 0.1);
  }
}

} // namespace
} // namespace packtrace::test
