#include "pbrt_import/shapes/quadrics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

#include "pbrt_import/scene/bounds.h"
#include "pbrt_import/scene/error.h"

namespace packtrace {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// A quadric, and what is known of it without the tessellation.
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

/// From (r, z) to z = k r^2. The nearest point lies between those straight above and straight across.
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
  // A quarter of the tolerance takes about twice as many segments, not many times more.
  EXPECT_LE(tessellate_cylinder({}, 1e-3).triangles.size(), 2u * 72u);
  EXPECT_LE(tessellate_sphere({}, 1e-3).triangles.size(), 2u * 102u * 52u);
  EXPECT_LE(tessellate_cone({}, 1e-3).triangles.size(), 72u);
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
      // Central differences, kept inside the surface.
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

/// Edges by position that have no partner running the other way; none may occur twice.
std::vector<std::pair<uint32_t, uint32_t>> boundary_edges(const Mesh& mesh, const std::string& name) {
  std::map<std::array<float, 3>, uint32_t> place;
  std::map<std::pair<uint32_t, uint32_t>, int> edges;
  const auto id = [&](uint32_t v) {
    const Vec3 p = mesh.positions[v] + Vec3(0.0f); // -0 and 0 are one place
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
    if (c.name == "double cone") continue; // both of its cones meet in one point: checked below
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
    if (c.area < 0.0) continue; // no closed form at hand
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
  for (const float scale : {1e-37f, 1e-20f, 1e20f, 1e37f}) {
    for (const Mesh& mesh :
         {tessellate_sphere({scale, -scale, scale, 360}, 0.01), tessellate_cone({scale, scale, 360}, 0.01),
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

TEST(Quadrics, TooManyVerticesAreRejectedBeforeAllocating) {
  EXPECT_EQ(error_of([] { tessellate_paraboloid({1e-3f, 0, 1e30f, 360}, 1e-4); }), ErrorKind::kLimitExceeded);
  EXPECT_EQ(error_of([] { tessellate_paraboloid({1, 0, 1e9f, 360}, 1e-6); }), ErrorKind::kLimitExceeded);
}

} // namespace
} // namespace packtrace
