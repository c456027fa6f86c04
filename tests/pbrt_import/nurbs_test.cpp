#include "pbrt_import/shapes/nurbs.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "pbrt_import/scene/error.h"

namespace packtrace {
namespace {

/// Keeps what NurbsParameters only looks at.
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

/// The unit sphere: a half circle (v, from the south pole) swept along a full one (u), both rational quadratics.
Patch sphere() {
  const auto h = static_cast<float>(std::sqrt(0.5));
  const glm::vec3 circle[] = {{1, 0, 1},   {1, 1, h},  {0, 1, 1},  {-1, 1, h}, {-1, 0, 1},
                              {-1, -1, h}, {0, -1, 1}, {1, -1, h}, {1, 0, 1}};           // x, y, w
  const glm::vec3 profile[] = {{0, -1, 1}, {1, -1, h}, {1, 0, 1}, {1, 1, h}, {0, 1, 1}}; // r, z, w
  Patch patch;
  patch.parameters.nu = 9;
  patch.parameters.nv = 5;
  patch.parameters.u_order = patch.parameters.v_order = 3;
  patch.u_knots = {0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4};
  patch.v_knots = {0, 0, 0, 1, 1, 2, 2, 2};
  for (const glm::vec3& p : profile)
    for (const glm::vec3& c : circle) {
      const float w = p.z * c.z;
      patch.points.emplace_back(p.x * c.x * w, p.x * c.y * w, p.y * w, w);
    }
  return patch;
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
    EXPECT_LE(worst, tolerance * std::sqrt(3.0)); // half the diagonal of the control points' box
    EXPECT_NEAR(volume, 4.0 / 3.0 * std::numbers::pi, 20 * tolerance);
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
      EXPECT_NEAR(glm::length(mesh.positions[i]), 1.0f, 1e-6f);
      const float worst_dot = std::abs(mesh.positions[i].z) < 0.99f ? 0.99999f : 0.95f; // poles: from the faces around
      EXPECT_GT(glm::dot(mesh.positions[i], mesh.normals[i]), worst_dot);
    }
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
  expect_error([](Patch& p) { p.points[0].w = 0.0f; });
  expect_error([](Patch& p) { p.points[1].y = std::numeric_limits<float>::infinity(); });
  expect_error([](Patch& p) { p.parameters.v1 = 2.0f; });
  expect_error([](Patch& p) { p.parameters.v0 = 1.0f; });
  Patch patch = good;
  EXPECT_THROW(tessellate_nurbs(patch.view(), 0.0), Error);
}

} // namespace
} // namespace packtrace
