#include "pbrt_import/shapes/nurbs.h"

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

/// NurbsParameters with the arrays that they refer to.
struct Patch {
  NurbsParameters parameters;
  std::vector<float> u_knots, v_knots;
  std::vector<glm::vec4> points;

  const NurbsParameters& view() {
    parameters.u_knots = u_knots;
    parameters.v_knots = v_knots;
    parameters.control_points = points;
    return parameters;
  }
};

Patch bilinear(Vec3 a, Vec3 b, Vec3 c, Vec3 d) {
  Patch patch;
  patch.parameters.nu = patch.parameters.nv = patch.parameters.u_order = patch.parameters.v_order = 2;
  patch.u_knots = patch.v_knots = {0, 0, 1, 1};
  patch.points = {{a, 1}, {b, 1}, {c, 1}, {d, 1}};
  return patch;
}

/// A full circle as a rational quadratic with nine control points: (x, y, w), where x and y are not multiplied by w.
const auto kHalf = static_cast<float>(std::sqrt(0.5));
const std::vector<glm::vec3> kCircle{{1, 0, 1},       {1, 1, kHalf}, {0, 1, 1},      {-1, 1, kHalf}, {-1, 0, 1},
                                     {-1, -1, kHalf}, {0, -1, 1},    {1, -1, kHalf}, {1, 0, 1}};
const std::vector<float> kCircleKnots{0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4};

/// Rotates a rational quadratic profile (r, z, w) along v around the z axis; u runs around the axis. r and z are not
/// multiplied by w.
Patch turned(const std::vector<glm::vec3>& profile, const std::vector<float>& knots) {
  Patch patch;
  patch.parameters.nu = 9;
  patch.parameters.nv = static_cast<uint32_t>(profile.size());
  patch.parameters.u_order = patch.parameters.v_order = 3;
  patch.u_knots = kCircleKnots;
  patch.v_knots = knots;
  for (const glm::vec3& p : profile)
    for (const glm::vec3& c : kCircle) {
      const float w = p.z * c.z;
      patch.points.emplace_back(p.x * c.x * w, p.x * c.y * w, p.y * w, w);
    }
  return patch;
}

/// The unit sphere, whose profile is a half circle from the south pole.
Patch sphere() {
  return turned({{0, -1, 1}, {1, -1, kHalf}, {1, 0, 1}, {1, 1, kHalf}, {0, 1, 1}}, {0, 0, 0, 1, 1, 2, 2, 2});
}

/// A torus with major radius 2 and minor radius 0.5.
Patch torus() {
  std::vector<glm::vec3> profile;
  for (const glm::vec3& c : kCircle) profile.emplace_back(2 + 0.5f * c.x, 0.5f * c.y, c.z);
  return turned(profile, kCircleKnots);
}

/// A rational arc of degree 2 in the xy plane, (wx, wy, w), extruded from z = 0 to 1.
Patch wall(const std::vector<glm::vec3>& arc) {
  Patch patch;
  patch.parameters.nu = patch.parameters.u_order = 3;
  patch.parameters.nv = patch.parameters.v_order = 2;
  patch.u_knots = {0, 0, 0, 1, 1, 1};
  patch.v_knots = {0, 0, 1, 1};
  for (const float z : {0.0f, 1.0f})
    for (const glm::vec3& p : arc) patch.points.emplace_back(p.x, p.y, z * p.z, p.z);
  return patch;
}

double area_of(const Mesh& mesh) {
  double area = 0.0;
  for (const Triangle& t : mesh.triangles) {
    const DVec3 a(mesh.positions[t.x]), b(mesh.positions[t.y]), c(mesh.positions[t.z]);
    area += glm::length(glm::cross(b - a, c - a)) / 2;
  }
  return area;
}

TEST(Nurbs, FlatPatchIsTwoTriangles) {
  const Mesh mesh = tessellate_nurbs(bilinear({0, 0, 3}, {2, 0, 3}, {0, 1, 3}, {2, 1, 3}).view(), 1e-3);
  EXPECT_EQ(mesh.positions, (std::vector<Vec3>{{0, 0, 3}, {2, 0, 3}, {0, 1, 3}, {2, 1, 3}}));
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 3}, {0, 3, 2}}));
  EXPECT_EQ(mesh.normals, std::vector<Vec3>(4, Vec3(0, 0, 1)));
  EXPECT_EQ(mesh.uvs, (std::vector<Vec2>{{0, 0}, {1, 0}, {0, 1}, {1, 1}}));
}

TEST(Nurbs, TwistedPatchIsRefinedThoughItsEdgesAreStraight) {
  const Mesh mesh = tessellate_nurbs(bilinear({0, 0, 0}, {1, 0, 1}, {0, 1, 1}, {1, 1, 0}).view(), 1e-3);
  ASSERT_GT(mesh.triangles.size(), 2u);
  for (const Triangle& t : mesh.triangles) {
    const Vec3 middle = (mesh.positions[t.x] + mesh.positions[t.y] + mesh.positions[t.z]) / 3.0f;
    EXPECT_NEAR(middle.z, middle.x + middle.y - 2 * middle.x * middle.y, 1e-3);
  }
}

TEST(Nurbs, RationalSphereIsRoundWithinTheTolerance) {
  for (const double tolerance : {0.05, 1e-3}) {
    const Mesh mesh = tessellate_nurbs(sphere().view(), tolerance);
    double worst = 0.0, volume = 0.0;
    for (const Triangle& t : mesh.triangles) {
      const DVec3 a(mesh.positions[t.x]), b(mesh.positions[t.y]), c(mesh.positions[t.z]);
      for (const DVec3 p : {(a + b + c) / 3.0, (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0})
        worst = std::max(worst, 1.0 - glm::length(p));
      volume += glm::dot(a, glm::cross(b, c)) / 6.0;
      EXPECT_TRUE(a != b && b != c && c != a);
    }
    EXPECT_LE(worst, tolerance * std::sqrt(3.0)); // half the diagonal of the control points' bounds
    EXPECT_NEAR(volume, 4.0 / 3.0 * std::numbers::pi, 20 * tolerance);
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
      EXPECT_NEAR(glm::length(mesh.positions[i]), 1.0f, 1e-6f);
      // Pole normals come from adjacent faces.
      const float worst_dot = std::abs(mesh.positions[i].z) < 0.99f ? 0.99999f : 0.95f;
      EXPECT_GT(glm::dot(mesh.positions[i], mesh.normals[i]), worst_dot);
    }
  }
}

TEST(Nurbs, RationalTorusHasItsAreaAndVolumeAndCloses) {
  for (const double tolerance : {0.05, 1e-3}) {
    const Mesh mesh = tessellate_nurbs(torus().view(), tolerance);
    double volume = 0.0;
    std::map<std::array<float, 3>, uint32_t> places;
    std::map<std::pair<uint32_t, uint32_t>, int> edges;
    const auto place = [&](uint32_t v) {
      const Vec3 p = mesh.positions[v] + Vec3(0.0f);
      return places.try_emplace({p.x, p.y, p.z}, static_cast<uint32_t>(places.size())).first->second;
    };
    for (const Triangle& t : mesh.triangles) {
      const DVec3 a(mesh.positions[t.x]), b(mesh.positions[t.y]), c(mesh.positions[t.z]);
      volume += glm::dot(a, glm::cross(b, c)) / 6.0;
      for (int k = 0; k < 3; ++k) ++edges[{place(t[k]), place(t[(k + 1) % 3])}];
    }
    for (const auto& [edge, count] : edges)
      EXPECT_EQ(edges.count({edge.second, edge.first}), 1u) << "the seams' positions are the same floats";
    constexpr double kPi = std::numbers::pi;
    // The tolerance is relative to half the diagonal of the 5 x 5 x 1 bounds, errors to the minor radius 0.5.
    const double worst = 2 * tolerance * std::sqrt(51.0) / 2 / 0.5;
    EXPECT_NEAR(area_of(mesh) / (4 * kPi * kPi * 2 * 0.5), 1.0, worst);
    EXPECT_NEAR(volume / (2 * kPi * kPi * 2 * 0.25), 1.0, worst);
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
      const Vec3 p = mesh.positions[i], ring = 2.0f * glm::normalize(Vec3(p.x, p.y, 0));
      EXPECT_NEAR(glm::distance(p, ring), 0.5f, 1e-6f);
      EXPECT_GT(glm::dot(glm::normalize(p - ring), mesh.normals[i]), 0.99999f);
    }
  }
}

TEST(Nurbs, WeightsMayBeZeroOrNegative) {
  const struct {
    std::vector<glm::vec3> arc;
    double angle; ///< angle of the circular arc in degrees
  } cases[] = {{{{1, 0, 1}, {kHalf, kHalf, kHalf}, {0, 1, 1}}, 90},
               {{{1, 0, 1}, {0, 1, 0}, {-1, 0, 1}}, 180},
               {{{1, 0, 1}, {-kHalf, -kHalf, -kHalf}, {0, 1, 1}}, 270},
               {{{-1, 0, -1}, {-kHalf, -kHalf, -kHalf}, {0, -1, -1}}, 90}};
  for (const auto& c : cases) {
    Patch patch = wall(c.arc);
    const Mesh mesh = tessellate_nurbs(patch.view(), 1e-4);
    for (const Vec3& p : mesh.positions) EXPECT_NEAR(std::hypot(p.x, p.y), 1.0f, 1e-6f);
    EXPECT_NEAR(area_of(mesh), c.angle * std::numbers::pi / 180, 1e-3);
  }
}

TEST(Nurbs, SurfacesThroughInfinityAreErrors) {
  for (const float w : {-1.0f, -4.0f, 0.0f}) {
    Patch patch = bilinear({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0});
    patch.points[3].w = w;
    EXPECT_THROW(tessellate_nurbs(patch.view(), 0.01), Error) << w;
  }
  Patch nowhere = wall({{1, 0, 0}, {0, 1, 0}, {1, 1, 0}});
  EXPECT_THROW(tessellate_nurbs(nowhere.view(), 0.01), Error);
}

std::vector<std::string> g_reports;
void keep_report(Severity severity, uint32_t, std::string message) {
  EXPECT_EQ(severity, Severity::kWarning);
  g_reports.push_back(std::move(message));
}

TEST(Nurbs, ToleranceThatIsNotReachedIsReported) {
  Patch torn; // a knot as often as the order: two sheets joined by a step
  torn.parameters.nu = 4;
  torn.parameters.nv = torn.parameters.u_order = torn.parameters.v_order = 2;
  torn.u_knots = {0, 0, 1, 1, 2, 2};
  torn.v_knots = {0, 0, 1, 1};
  for (const float y : {0.0f, 1.0f})
    for (const float x : {0.0f, 1.0f, 5.0f, 6.0f}) torn.points.emplace_back(x, y, 0, 1);
  g_reports.clear();
  const Mesh mesh = tessellate_nurbs(torn.view(), 1e-3, keep_report);
  EXPECT_EQ(mesh.triangles.size(), 2u * 2u * 128u);
  EXPECT_NEAR(area_of(mesh), 6.0, 1e-4);
  ASSERT_EQ(g_reports.size(), 1u);
  // The midpoint of the step's cell is 2 away from the chord; the reached tolerance is twice that over half the
  // diagonal of the bounds.
  EXPECT_EQ(g_reports[0], "the surface is followed to within 1.3 of its size only, not the tolerance of 0.001");
  g_reports.clear();
  (void)tessellate_nurbs(sphere().view(), 1e-3, keep_report);
  EXPECT_TRUE(g_reports.empty());
}

TEST(Nurbs, LongWorkCanBeCancelled) {
  for (const int calls : {0, 5, 40}) {
    int left = calls;
    const CheckCancelledFn check = [&] {
      if (left-- == 0) throw Error(ErrorKind::kCancelled, "stop");
    };
    try {
      (void)tessellate_nurbs(torus().view(), 1e-3, {}, check);
      ADD_FAILURE() << "not stopped";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kCancelled);
    }
    EXPECT_EQ(left, -1);
  }
}

TEST(Nurbs, RangesCutThePatch) {
  Patch patch = bilinear({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0});
  patch.parameters.u0 = 0.25f;
  patch.parameters.u1 = 0.5f;
  const Mesh mesh = tessellate_nurbs(patch.view(), 0.01);
  EXPECT_EQ(mesh.positions, (std::vector<Vec3>{{0.25f, 0, 0}, {0.5f, 0, 0}, {0.25f, 1, 0}, {0.5f, 1, 0}}));
}

TEST(Nurbs, CreasesAtKnotsAreKept) {
  Patch patch;
  patch.parameters.nu = 3;
  patch.parameters.nv = patch.parameters.u_order = patch.parameters.v_order = 2;
  patch.u_knots = {0, 0, 0.3f, 1, 1};
  patch.v_knots = {0, 0, 1, 1};
  patch.points = {{0, 0, 0, 1}, {1, 0, 5, 1}, {2, 0, 0, 1}, {0, 1, 0, 1}, {1, 1, 5, 1}, {2, 1, 0, 1}};
  const Mesh mesh = tessellate_nurbs(patch.view(), 0.01);
  EXPECT_EQ(mesh.triangles.size(), 4u);
  EXPECT_EQ(mesh.positions[1], Vec3(1, 0, 5));
}

TEST(Nurbs, WhatDoesNotFitTogetherIsAnError) {
  const Patch good = bilinear({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0});
  const auto expect_error = [&](auto change) {
    Patch patch = good;
    change(patch);
    EXPECT_THROW(tessellate_nurbs(patch.view(), 0.01), Error);
  };
  expect_error([](Patch& p) { p.parameters.nu = 3; });
  expect_error([](Patch& p) { p.parameters.nu = p.parameters.nv = 4294967295u; });
  expect_error([](Patch& p) { p.parameters.u_order = 1; });
  expect_error([](Patch& p) { p.parameters.u_order = 4000000000u; });
  expect_error([](Patch& p) { p.u_knots = {0, 0, 1}; });
  expect_error([](Patch& p) { p.u_knots = {0, 1, 0, 1}; });
  expect_error([](Patch& p) { p.u_knots = {0, 1, 1, 1}; });
  expect_error([](Patch& p) { p.u_knots[3] = std::numeric_limits<float>::quiet_NaN(); });
  expect_error([](Patch& p) { p.points.pop_back(); });
  expect_error([](Patch& p) { p.points[0].w = std::numeric_limits<float>::quiet_NaN(); });
  expect_error([](Patch& p) { p.points[1].y = std::numeric_limits<float>::infinity(); });
  expect_error([](Patch& p) { p.parameters.v1 = 2.0f; });
  expect_error([](Patch& p) { p.parameters.v0 = 1.0f; });
  Patch patch = good;
  EXPECT_THROW(tessellate_nurbs(patch.view(), 0.0), Error);
}

} // namespace
} // namespace packtrace
