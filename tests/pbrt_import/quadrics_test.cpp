#include "pbrt_import/shapes/quadrics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/scene/bounds.h"

namespace packtrace {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// A quadric with properties that are known without the tessellation.
struct Case {
  std::string name;
  std::function<Mesh(double tolerance)> tessellate;
  std::function<double(DVec3)> distance; ///< an upper bound of the distance to the unlimited surface
  std::function<DVec3(double u, double v)> point;
  double radius = 1.0;
  double area = 0.0;
  bool closed = false; ///< without a boundary
  uint32_t boundary_loops = 0;
};

double radial(DVec3 p) { return std::hypot(p.x, p.y); }
DVec3 around(double r, double phi, double z) { return {r * std::cos(phi), r * std::sin(phi), z}; }
double radians(double degrees) { return degrees * kPi / 180.0; }

Case sphere(const std::string& name, SphereParameters s, uint32_t loops) {
  const double r = s.radius, low = std::clamp<double>(std::min(s.z_min, s.z_max), -r, r),
               high = std::clamp<double>(std::max(s.z_min, s.z_max), -r, r);
  const double a = std::acos(low / r), b = std::acos(high / r), phi = radians(std::min(s.phi_max, 360.0f));
  return {name,
          [=](double t) { return tessellate_sphere(s, t); },
          [=](DVec3 p) { return std::abs(glm::length(p) - r); },
          [=](double u, double v) {
            const double theta = a + v * (b - a);
            return around(r * std::sin(theta), u * phi, r * std::cos(theta));
          },
          r,
          phi * r * (high - low),
          loops == 0,
          loops};
}

Case cylinder(const std::string& name, CylinderParameters c, uint32_t loops) {
  const double r = c.radius, low = std::min(c.z_min, c.z_max), high = std::max(c.z_min, c.z_max);
  const double phi = radians(c.phi_max);
  return {name,
          [=](double t) { return tessellate_cylinder(c, t); },
          [=](DVec3 p) { return std::abs(radial(p) - r); },
          [=](double u, double v) { return around(r, u * phi, low + v * (high - low)); },
          r,
          phi * r * (high - low),
          false,
          loops};
}

Case disk(const std::string& name, DiskParameters d, uint32_t loops) {
  const double r = d.radius, inner = d.inner_radius, phi = radians(d.phi_max);
  return {name,
          [=](double t) { return tessellate_disk(d, t); },
          [=](DVec3 p) { return std::max(std::abs(p.z - d.height), inner - radial(p)); },
          [=](double u, double v) { return around(r + v * (inner - r), u * phi, d.height); },
          r,
          phi * (r * r - inner * inner) / 2,
          false,
          loops};
}

Case cone(const std::string& name, ConeParameters c, uint32_t loops) {
  const double r = c.radius, h = c.height, phi = radians(c.phi_max);
  return {name,
          [=](double t) { return tessellate_cone(c, t); },
          [=](DVec3 p) { return std::abs(radial(p) - r * (1.0 - p.z / h)); },
          [=](double u, double v) { return around(r * (1.0 - v), u * phi, v * h); },
          r,
          phi * r * std::hypot(r, h) / 2,
          false,
          loops};
}

/// Distance from (r, z) to z = k r^2. The nearest point lies between the vertical and the horizontal projection.
double distance_to_parabola(double k, double r, double z) {
  double a = r, b = std::sqrt(std::max(0.0, z / k));
  const auto at = [&](double x) { return std::hypot(x - r, k * x * x - z); };
  for (int i = 0; i < 30; ++i) {
    const double third = (b - a) / 3;
    if (at(a + third) < at(b - third))
      b -= third;
    else
      a += third;
  }
  return std::min({at(a), at(r), at(b)});
}

Case paraboloid(const std::string& name, ParaboloidParameters q, double radius, uint32_t loops) {
  const double low = std::min(q.z_min, q.z_max), high = std::max(q.z_min, q.z_max), phi = radians(q.phi_max);
  const double k = high / (double{q.radius} * q.radius);
  const auto primitive = [k](double r) { return std::pow(1.0 + 4.0 * k * k * r * r, 1.5) / (12.0 * k * k); };
  const double first = std::sqrt((high > 0 ? std::max(low, 0.0) : low) / k);
  return {name,
          [=](double t) { return tessellate_paraboloid(q, t); },
          [=](DVec3 p) { return distance_to_parabola(k, radial(p), p.z); },
          [=](double u, double v) {
            const double z = low + v * (high - low);
            return around(std::sqrt(z / k), u * phi, z);
          },
          radius,
          phi * std::abs(primitive(q.radius) - primitive(first)),
          false,
          loops};
}

Case hyperboloid(const std::string& name, HyperboloidParameters q, double radius, double area, uint32_t loops) {
  const bool turned = q.p2.z == 0.0f;
  const DVec3 p1(turned ? q.p2 : q.p1), p2(turned ? q.p1 : q.p2);
  const double phi = radians(q.phi_max);
  return {name,
          [=](double t) { return tessellate_hyperboloid(q, t); },
          [=](DVec3 p) { return std::abs(radial(p) - radial(p1 + (p.z - p1.z) / (p2.z - p1.z) * (p2 - p1))); },
          [=](double u, double v) {
            const DVec3 p = p1 + v * (p2 - p1);
            const double c = std::cos(u * phi), s = std::sin(u * phi);
            return DVec3(p.x * c - p.y * s, p.x * s + p.y * c, p.z);
          },
          radius,
          area,
          false,
          loops};
}

std::vector<Case> all_cases() {
  return {
      sphere("sphere", {}, 0),
      sphere("sphere of radius 3", {3.0f, -3.0f, 3.0f, 360.0f}, 0),
      sphere("sphere zone", {2.0f, 1.5f, -0.5f, 360.0f}, 2),
      sphere("sphere cap, limits beyond it", {2.0f, 1.0f, 77.0f, 400.0f}, 1),
      sphere("sphere wedge", {1.0f, -1.0f, 1.0f, 75.0f}, 1),
      cylinder("cylinder", {}, 2),
      cylinder("cylinder piece", {0.25f, 7.0f, -2.0f, 200.0f}, 1),
      disk("disk", {}, 1),
      disk("ring", {-3.0f, 4.0f, 1.0f, 360.0f}, 2),
      disk("ring piece", {0.5f, 4.0f, 3.5f, 10.0f}, 1),
      cone("cone", {}, 1),
      cone("flat cone piece", {2.0f, 0.125f, 300.0f}, 1),
      paraboloid("paraboloid", {}, 1.0, 1),
      paraboloid("tall paraboloid", {0.5f, 0.0f, 20.0f, 360.0f}, 0.5, 1),
      paraboloid("paraboloid from below its apex", {1.0f, -2.0f, 1.0f, 360.0f}, 1.0, 1),
      paraboloid("paraboloid ring", {2.0f, 3.0f, 1.0f, 360.0f}, 2.0, 2),
      paraboloid("hanging paraboloid piece", {1.0f, -4.0f, -1.0f, 90.0f}, 2.0, 1),
      hyperboloid("hyperboloid by default: a cone", {}, std::sqrt(2.0), 2 * kPi * std::sqrt(2.0) * std::sqrt(3.0) / 2,
                  1),
      hyperboloid("cylinder as hyperboloid", {{1, 0, -1}, {1, 0, 2}, 360}, 1.0, 2 * kPi * 3, 2),
      hyperboloid("twisted hyperboloid", {{1, -1, -1}, {1, 1, 1}, 360}, std::sqrt(2.0), -1.0, 2),
      hyperboloid("turned hyperboloid", {{2, 1, 3}, {1, 2, 0}, 120}, std::sqrt(5.0), -1.0, 1),
      hyperboloid("double cone", {{-1, 0, -1}, {2, 0, 2}, 360}, 2.0, kPi * std::sqrt(2.0) * (1 + 4), 2),
  };
}

DVec3 corner(const Mesh& mesh, const Triangle& t, int k) { return DVec3(mesh.positions[t[k]]); }

DVec3 area_vector(const Mesh& mesh, const Triangle& t) {
  return 0.5 * glm::cross(corner(mesh, t, 1) - corner(mesh, t, 0), corner(mesh, t, 2) - corner(mesh, t, 0));
}

TEST(Quadrics, NoTriangleLeavesTheSurfaceByMoreThanTheTolerance) {
  for (const Case& c : all_cases()) {
    for (const double tolerance : {0.5, 0.05, 0.001}) {
      const Mesh mesh = c.tessellate(tolerance);
      double worst = 0.0, worst_vertex = 0.0;
      for (const Vec3& p : mesh.positions) worst_vertex = std::max(worst_vertex, c.distance(DVec3(p)));
      constexpr int kSteps = 4;
      for (const Triangle& t : mesh.triangles)
        for (int i = 0; i <= kSteps; ++i)
          for (int j = 0; i + j <= kSteps; ++j)
            worst = std::max(worst, c.distance((corner(mesh, t, 0) * double(i) + corner(mesh, t, 1) * double(j) +
                                                corner(mesh, t, 2) * double(kSteps - i - j)) /
                                               double(kSteps)));
      EXPECT_LE(worst, tolerance * c.radius * (1 + 1e-5)) << c.name << " " << tolerance;
      EXPECT_LE(worst_vertex, 1e-5 * std::max(c.radius, 1.0)) << c.name << " " << tolerance;
    }
  }
}

TEST(Quadrics, TheToleranceIsNotWasted) {
  // With half the tolerance, the sweep needs 2 pi / (2 acos(1 - tolerance / 2)) = 99.3 columns, rounded up to 100.
  EXPECT_EQ(tessellate_cylinder({}, 1e-3).triangles.size(), 2u * 100u);
  EXPECT_EQ(tessellate_cone({}, 1e-3).triangles.size(), 100u);
  EXPECT_LE(tessellate_sphere({}, 1e-3).triangles.size(), 2u * 100u * 50u);
  EXPECT_LE(tessellate_paraboloid({}, 1e-3).triangles.size(), 2u * 100u * 33u);
}

TEST(Quadrics, VerticesAreWhereTheirUvsSay) {
  for (const Case& c : all_cases()) {
    const Mesh mesh = c.tessellate(0.01);
    ASSERT_EQ(mesh.uvs.size(), mesh.positions.size());
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
      const DVec3 expected = c.point(mesh.uvs[i].x, mesh.uvs[i].y);
      EXPECT_NEAR(glm::distance(expected, DVec3(mesh.positions[i])), 0.0, 2e-3 * std::max(c.radius, 1.0))
          << c.name << " u " << mesh.uvs[i].x << " v " << mesh.uvs[i].y;
    }
  }
}

TEST(Quadrics, NormalsAndWindingFollowTheParameterDirections) {
  for (const Case& c : all_cases()) {
    const Mesh mesh = c.tessellate(0.01);
    ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
    std::vector<uint8_t> at_apex(mesh.positions.size(), 0);
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
      EXPECT_NEAR(glm::length(mesh.normals[i]), 1.0f, 1e-6f);
      // Central differences inside the parameter range.
      const double h = 1e-5, u = std::clamp<double>(mesh.uvs[i].x, h, 1 - h),
                   v = std::clamp<double>(mesh.uvs[i].y, h, 1 - h);
      const DVec3 du = c.point(u + h, v) - c.point(u - h, v), dv = c.point(u, v + h) - c.point(u, v - h);
      at_apex[i] = radial(DVec3(mesh.positions[i])) < 1e-3 * c.radius;
      if (at_apex[i] || !is_finite(du) || !is_finite(dv)) continue;
      EXPECT_GT(glm::dot(glm::normalize(glm::cross(du, dv)), DVec3(mesh.normals[i])), 0.9999) << c.name << " " << i;
    }
    for (const Triangle& t : mesh.triangles)
      for (int k = 0; k < 3; ++k)
        ASSERT_GT(glm::dot(glm::normalize(area_vector(mesh, t)), DVec3(mesh.normals[t[k]])), 0.5) << c.name;
  }
}

/// Edges, identified by positions, without an opposite edge; no edge may occur twice in one direction.
std::vector<std::pair<uint32_t, uint32_t>> boundary_edges(const Mesh& mesh, const std::string& name) {
  std::map<std::array<float, 3>, uint32_t> place;
  std::map<std::pair<uint32_t, uint32_t>, int> edges;
  const auto id = [&](uint32_t v) {
    const Vec3 p = mesh.positions[v] + Vec3(0.0f); // -0 and 0 are equal
    return place.try_emplace({p.x, p.y, p.z}, static_cast<uint32_t>(place.size())).first->second;
  };
  for (const Triangle& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) ++edges[{id(t[k]), id(t[(k + 1) % 3])}];
  std::vector<std::pair<uint32_t, uint32_t>> open;
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1) << name;
    EXPECT_NE(edge.first, edge.second) << name << ": degenerate triangle";
    if (!edges.count({edge.second, edge.first})) open.push_back(edge);
  }
  return open;
}

TEST(Quadrics, SeamsAndPolesAreWatertightByPosition) {
  for (const Case& c : all_cases()) {
    if (c.name == "double cone") continue; // its two cones meet in a point; checked below
    const auto open = boundary_edges(c.tessellate(0.01), c.name);
    std::map<uint32_t, uint32_t> next(open.begin(), open.end());
    EXPECT_EQ(next.size(), open.size()) << c.name;
    uint32_t loops = 0;
    while (!next.empty()) {
      const uint32_t start = next.begin()->first;
      uint32_t at = start;
      do {
        const auto step = next.find(at);
        ASSERT_NE(step, next.end()) << c.name;
        at = step->second;
        next.erase(step);
      } while (at != start);
      ++loops;
    }
    EXPECT_EQ(loops, c.boundary_loops) << c.name;
  }
}

TEST(Quadrics, NoTriangleIsDegenerate) {
  for (const Case& c : all_cases()) {
    const Mesh mesh = c.tessellate(0.01);
    for (const Triangle& t : mesh.triangles) ASSERT_GT(glm::length(area_vector(mesh, t)), 1e-9) << c.name;
  }
}

TEST(Quadrics, AreasConvergeToTheAnalyticOnes) {
  for (const Case& c : all_cases()) {
    if (c.area < 0.0) continue; // no closed form
    const Mesh mesh = c.tessellate(1e-4);
    double area = 0.0;
    for (const Triangle& t : mesh.triangles) area += glm::length(area_vector(mesh, t));
    EXPECT_NEAR(area / c.area, 1.0, 1e-3) << c.name;
  }
}

TEST(Quadrics, FullSweepsReachTheirBoundingBox) {
  const Bounds box = bounds_of(tessellate_sphere({2.0f, -2.0f, 2.0f, 360.0f}, 0.02).positions);
  EXPECT_EQ(box.lo, DVec3(-2.0));
  EXPECT_EQ(box.hi, DVec3(2.0));
  const Bounds cylinder_box = bounds_of(tessellate_cylinder({0.5f, 1.0f, -3.0f, 360.0f}, 0.02).positions);
  EXPECT_EQ(cylinder_box.lo, DVec3(-0.5, -0.5, -3.0));
  EXPECT_EQ(cylinder_box.hi, DVec3(0.5, 0.5, 1.0));
}

TEST(Quadrics, DefaultHyperboloidIsACone) {
  const Mesh mesh = tessellate_hyperboloid({}, 0.001);
  for (const Vec3& p : mesh.positions) EXPECT_NEAR(std::hypot(p.x, p.y), std::sqrt(2.0f) * p.z, 1e-6f);
  EXPECT_FALSE(mesh.triangles.empty());
}

TEST(Quadrics, DoubleConeHasNormalsOfItsOwnOnEachSideOfTheApex) {
  const Mesh mesh = tessellate_hyperboloid({{-1, 0, -1}, {2, 0, 2}, 360}, 0.01);
  size_t apex_count = 0, below = 0;
  for (size_t i = 0; i < mesh.positions.size(); ++i) {
    if (mesh.positions[i] != Vec3(0.0f)) continue;
    ++apex_count;
    below += mesh.normals[i].z > 0.0f;
  }
  EXPECT_GT(apex_count, 0u);
  EXPECT_EQ(below * 2, apex_count);
}

TEST(Quadrics, ExtremeScalesStayFinite) {
  for (const float scale : {1e-37f, 1e-30f, 1e-20f, 1e20f, 1e30f, 1e37f}) {
    for (const Mesh& mesh :
         {tessellate_sphere({scale, -scale, scale, 360}, 0.01), tessellate_cone({scale, scale, 360}, 0.01),
          tessellate_cylinder({scale, -scale, 1, 360}, 0.01), tessellate_disk({scale, scale, scale / 2, 360}, 0.01),
          tessellate_paraboloid({scale, 0, scale, 360}, 0.01),
          tessellate_hyperboloid({{scale, 0, 0}, {0, scale, scale}, 360}, 0.01)}) {
      for (const Vec3& p : mesh.positions) ASSERT_TRUE(is_finite(p));
      for (const Vec3& n : mesh.normals) ASSERT_NEAR(glm::length(n), 1.0f, 1e-6f);
    }
  }
}

template <class F>
std::optional<ErrorKind> error_of(F f) {
  try {
    f();
  } catch (const Error& error) {
    return error.kind();
  }
  return std::nullopt;
}

TEST(Quadrics, ParametersThatLeaveNothingToDrawAreErrors) {
  for (const float bad : {kNan, kInfinity, -kInfinity, 0.0f, -1.0f}) {
    EXPECT_EQ(error_of([=] { tessellate_sphere({bad, -1, 1, 360}, 0.01); }), ErrorKind::kInput) << bad;
    EXPECT_EQ(error_of([=] { tessellate_cylinder({bad, -1, 1, 360}, 0.01); }), ErrorKind::kInput) << bad;
    EXPECT_EQ(error_of([=] { tessellate_disk({0, bad, 0, 360}, 0.01); }), ErrorKind::kInput) << bad;
    EXPECT_EQ(error_of([=] { tessellate_cone({bad, 1, 360}, 0.01); }), ErrorKind::kInput) << bad;
    EXPECT_EQ(error_of([=] { tessellate_cone({1, bad, 360}, 0.01); }), ErrorKind::kInput) << bad;
    EXPECT_EQ(error_of([=] { tessellate_paraboloid({bad, 0, 1, 360}, 0.01); }), ErrorKind::kInput) << bad;
    EXPECT_EQ(error_of([=] { tessellate_sphere({1, -1, 1, bad}, 0.01); }), ErrorKind::kInput) << bad;
    EXPECT_EQ(error_of([=] { tessellate_hyperboloid({{0, 0, 0}, {1, 1, 1}, bad}, 0.01); }), ErrorKind::kInput) << bad;
    if (std::isfinite(bad)) continue;
    EXPECT_EQ(error_of([=] { tessellate_sphere({1, bad, 1, 360}, 0.01); }), ErrorKind::kInput) << bad;
    EXPECT_EQ(error_of([=] { tessellate_cylinder({1, 0, bad, 360}, 0.01); }), ErrorKind::kInput) << bad;
    EXPECT_EQ(error_of([=] { tessellate_disk({bad, 1, 0, 360}, 0.01); }), ErrorKind::kInput) << bad;
    EXPECT_EQ(error_of([=] { tessellate_disk({0, 1, bad, 360}, 0.01); }), ErrorKind::kInput) << bad;
    EXPECT_EQ(error_of([=] { tessellate_paraboloid({1, bad, 1, 360}, 0.01); }), ErrorKind::kInput) << bad;
    EXPECT_EQ(error_of([=] { tessellate_hyperboloid({{bad, 0, 0}, {1, 1, 1}, 360}, 0.01); }), ErrorKind::kInput) << bad;
  }
  EXPECT_EQ(error_of([] { tessellate_sphere({1, 5, 6, 360}, 0.01); }), ErrorKind::kInput);
  EXPECT_EQ(error_of([] { tessellate_cylinder({1, 2, 2, 360}, 0.01); }), ErrorKind::kInput);
  EXPECT_EQ(error_of([] { tessellate_disk({0, 1, 1, 360}, 0.01); }), ErrorKind::kInput);
  EXPECT_EQ(error_of([] { tessellate_paraboloid({1, -1, 0, 360}, 0.01); }), ErrorKind::kInput);
  EXPECT_EQ(error_of([] { tessellate_hyperboloid({{1, 0, 2}, {2, 0, 2}, 360}, 0.01); }), ErrorKind::kInput);
  EXPECT_EQ(error_of([] { tessellate_hyperboloid({{0, 0, 1}, {0, 0, 2}, 360}, 0.01); }), ErrorKind::kInput);
  for (const double tolerance : {0.0, -1.0, 1e-7, 0.6, double{kNan}})
    EXPECT_EQ(error_of([=] { tessellate_disk({}, tolerance); }), ErrorKind::kInput) << tolerance;
}

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
