// Rims where quadrics meet, volumes, counts of vertices, and parameters at the end of their ranges.

#include <array>
#include <set>
#include <utility>

#include "tests/pbrt_import/quadric_cases.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

using namespace quadric_test;

TEST(Quadrics, SteepParaboloidsTakeFewRows) {
  // Equal steps in r would need 10^4 rows for the first height and 10^18 for the last.
  for (const float height : {1e3f, 1e9f, 1e30f}) {
    const Case c = paraboloid("steep", {1e-3f, 0, height, 360}, 1e-3, 1);
    const Mesh mesh = c.tessellate(1e-3);
    EXPECT_LE(mesh.positions.size(), 101u * 50u) << height;
    double area = 0.0;
    for (const Triangle& t : mesh.triangles) area += glm::length(area_vector(mesh, t));
    // The surface is almost that of cones between the circles, 4/3 pi r h in total; the polygons lose 1 - sinc(pi/100).
    EXPECT_NEAR(area / (4.0 / 3.0 * kPi * 1e-3 * height), 1.0, 3e-3) << height;
  }
}

TEST(Quadrics, VerticesStayFewAtTheFinestTolerance) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  constexpr size_t kMax = size_t{1} << 23;
  EXPECT_LT(tessellate_sphere({}, 1e-6).positions.size(), kMax);
  EXPECT_LT(tessellate_paraboloid({1e-3f, 0, 1e30f, 360}, 1e-6).positions.size(), kMax);
  EXPECT_LT(tessellate_hyperboloid({{1, -1e-3f, -1}, {-1, 1e-3f, 1}, 360}, 1e-6).positions.size(), kMax);
}

using Place = std::array<float, 3>;
Place place_of(Vec3 p) { return {p.x, p.y, p.z}; }

using Edge = std::pair<Place, Place>;

/// The boundary edges along the circle of a given radius and height.
std::set<Edge> rim_of(const Mesh& mesh, float radius, float z) {
  std::map<Edge, int> edges;
  for (const Triangle& t : mesh.triangles)
    for (int k = 0; k < 3; ++k)
      ++edges[std::minmax(place_of(mesh.positions[t[k]]), place_of(mesh.positions[t[(k + 1) % 3]]))];
  const auto is_on_circle = [&](const Place& p) {
    return p[2] == z && std::abs(std::hypot(p[0], p[1]) - radius) < 1e-5f * radius;
  };
  std::set<Edge> rim;
  for (const auto& [edge, count] : edges)
    if (count == 1 && is_on_circle(edge.first) && is_on_circle(edge.second)) rim.insert(edge);
  return rim;
}

TEST(Quadrics, ShapesThatMeetInACircleHaveTheSameRim) {
  for (const float phi : {360.0f, 180.0f, 123.4f}) {
    for (const double tolerance : {0.5, 0.01, 1e-3}) {
      const float r = 0.7f, h = 1.3f;
      const std::set<Edge> rim = rim_of(tessellate_disk({h, r, 0, phi}, tolerance), r, h);
      EXPECT_GE(rim.size(), phi == 360.0f ? 8u : 2u);
      EXPECT_EQ(rim_of(tessellate_disk({h, 2 * r, r, phi}, tolerance), r, h), rim);
      EXPECT_EQ(rim_of(tessellate_cylinder({r, h, -2, phi}, tolerance), r, h), rim);
      EXPECT_EQ(rim_of(tessellate_paraboloid({r, 0.1f, h, phi}, tolerance), r, h), rim);
      EXPECT_EQ(rim_of(tessellate_hyperboloid({{r, 0, h}, {0.2f, 0.9f, -1}, phi}, tolerance), r, h), rim);
      const std::set<Edge> base = rim_of(tessellate_disk({0, r, 0, phi}, tolerance), r, 0);
      EXPECT_EQ(rim_of(tessellate_cone({r, h, phi}, tolerance), r, 0), base);
      EXPECT_EQ(rim_of(tessellate_sphere({r, 0, r, phi}, tolerance), r, 0), base);
      EXPECT_EQ(rim_of(tessellate_sphere({r, -r, 0, phi}, tolerance), r, 0), base);
      const float z = 0.42f, at_z = 0.56f; // a right triangle with sides 3, 4 and 5
      const std::set<Edge> cut = rim_of(tessellate_sphere({r, -r, z, phi}, tolerance), at_z, z);
      EXPECT_EQ(cut.size(), rim.size());
      EXPECT_EQ(rim_of(tessellate_sphere({r, z, r, phi}, tolerance), at_z, z), cut);
    }
  }
}

/// Six times the signed volume between the mesh and the origin.
double six_volumes(const Mesh& mesh) {
  double sum = 0.0;
  for (const Triangle& t : mesh.triangles)
    sum += glm::dot(corner(mesh, t, 0), glm::cross(corner(mesh, t, 1), corner(mesh, t, 2)));
  return sum;
}

TEST(Quadrics, VolumesConvergeToTheAnalyticOnesFromInside) {
  const double r = 1.5, h = 2.25;
  const auto disk_volume = [&](double tolerance, double height) { // of a disk that faces up
    return six_volumes(tessellate_disk({static_cast<float>(height), 1.5f, 0, 360}, tolerance));
  };
  struct Solid {
    const char* name;
    std::function<double(double)> six_volumes_at;
    double volume;
  };
  const Solid solids[] = {
      {"sphere", [](double t) { return six_volumes(tessellate_sphere({1.5f, -1.5f, 1.5f, 360}, t)); },
       4.0 / 3.0 * kPi * r * r * r},
      {"half sphere with its disk at 0",
       [](double t) { return six_volumes(tessellate_sphere({1.5f, 0, 1.5f, 360}, t)); }, 2.0 / 3.0 * kPi * r * r * r},
      {"cylinder with two disks",
       [&](double t) {
         return six_volumes(tessellate_cylinder({1.5f, 2.25f, -1, 360}, t)) + disk_volume(t, h) - disk_volume(t, -1);
       },
       kPi * r * r * (h + 1)},
      {"cone with its disk at 0", [](double t) { return six_volumes(tessellate_cone({1.5f, 2.25f, 360}, t)); },
       kPi * r * r * h / 3},
      {"paraboloid with its disk",
       [&](double t) { return six_volumes(tessellate_paraboloid({1.5f, 0, 2.25f, 360}, t)) + disk_volume(t, h); },
       kPi * r * r * h / 2},
  };
  for (const Solid& solid : solids) {
    for (const double tolerance : {0.05, 1e-3, 1e-5}) {
      const double error = 1.0 - solid.six_volumes_at(tolerance) / 6.0 / solid.volume;
      EXPECT_GE(error, -1e-6) << solid.name << " " << tolerance << ": inscribed";
      EXPECT_LE(error, 4.0 * tolerance) << solid.name << " " << tolerance; // at most area / volume x radius
    }
  }
}

TEST(Quadrics, QuarterTurnsAreExact) {
  const Mesh mesh = tessellate_cylinder({3.0f, 0, 1, 270}, 0.01);
  for (const Vec3 expected : {Vec3(3, 0, 0), Vec3(0, -3, 0), Vec3(3, 0, 1), Vec3(0, -3, 1)})
    EXPECT_NE(std::find(mesh.positions.begin(), mesh.positions.end(), expected), mesh.positions.end());
  EXPECT_EQ(tessellate_disk({0, 3, 0, 180}, 0.01).positions.at(0), Vec3(3, 0, 0));
}

TEST(Quadrics, LimitsMayComeInEitherOrder) {
  const auto same = [](const Mesh& a, const Mesh& b) {
    return a.positions == b.positions && a.normals == b.normals && a.uvs == b.uvs && a.triangles == b.triangles;
  };
  EXPECT_TRUE(same(tessellate_sphere({2, -1, 1.5f, 200}, 0.01), tessellate_sphere({2, 1.5f, -1, 200}, 0.01)));
  EXPECT_TRUE(same(tessellate_sphere({2, -9, 9, 400}, 0.01), tessellate_sphere({2, 2, -2, 360}, 0.01)));
  EXPECT_TRUE(same(tessellate_cylinder({2, -1, 3, 200}, 0.01), tessellate_cylinder({2, 3, -1, 200}, 0.01)));
  EXPECT_TRUE(same(tessellate_paraboloid({2, 1, 3, 200}, 0.01), tessellate_paraboloid({2, 3, 1, 200}, 0.01)));
}

TEST(Quadrics, WhatFloatsCannotTellApartIsLeftOut) {
  // For neighbouring floats, some points of the two circles round to the same position and others do not.
  const float radius = std::nextafter(2.0f, 0.0f), inner = std::nextafter(radius, 0.0f);
  const Mesh ring = tessellate_disk({0, radius, inner, 360}, 1e-3);
  EXPECT_FALSE(ring.triangles.empty());
  EXPECT_LT(ring.triangles.size(), 200u);
  std::vector<uint8_t> used(ring.positions.size(), 0);
  for (const Triangle& t : ring.triangles)
    for (int k = 0; k < 3; ++k) {
      EXPECT_NE(ring.positions[t[k]], ring.positions[t[(k + 1) % 3]]);
      used[t[k]] = 1;
    }
  EXPECT_EQ(std::count(used.begin(), used.end(), 0), 0);
  EXPECT_EQ(error_of([] { tessellate_cylinder({1e-44f, 0, 1, 1e-3f}, 0.01); }), ErrorKind::kInput);
  EXPECT_EQ(error_of([] { tessellate_paraboloid({1, -1e38f, -1e-45f, 360}, 0.01); }), ErrorKind::kInput);
  EXPECT_EQ(error_of([] { tessellate_hyperboloid({{3e38f, 3e38f, 0}, {1, 0, 1}, 360}, 0.01); }), ErrorKind::kInput);
}

} // namespace
} // namespace packtrace
