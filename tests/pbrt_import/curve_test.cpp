#include "pbrt_import/shapes/curve.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/scene/bounds.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

const std::vector<Vec3> kStraight{{0, 0, 0}, {0, 0, 1}, {0, 0, 2}, {0, 0, 3}};
const std::vector<Vec3> kBent{{0, 0, 0}, {0, 0, 4}, {4, 0, 4}, {4, 4, 4}};

CurveParameters curve_through(const std::vector<Vec3>& points, float width = 0.5f) {
  CurveParameters curve;
  curve.points = points;
  curve.width0 = curve.width1 = width;
  return curve;
}

void expect_sound(const Mesh& mesh) {
  ASSERT_FALSE(mesh.triangles.empty());
  ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
  ASSERT_EQ(mesh.uvs.size(), mesh.positions.size());
  for (const Vec3& n : mesh.normals) ASSERT_NEAR(glm::length(n), 1.0f, 1e-5f);
  for (const Triangle& t : mesh.triangles) {
    const Vec3 p0 = mesh.positions[t.x], n = glm::cross(mesh.positions[t.y] - p0, mesh.positions[t.z] - p0);
    ASSERT_GT(glm::length(n), 0.0f);
    for (int k = 0; k < 3; ++k) EXPECT_GT(glm::dot(glm::normalize(n), mesh.normals[t[k]]), 0.5f);
  }
}

/// Distance from p to the cubic Bezier curve, by sampling.
float distance_to(const std::vector<Vec3>& b, Vec3 p) {
  float nearest = std::numeric_limits<float>::infinity();
  for (int i = 0; i <= 10000; ++i) {
    const float t = static_cast<float>(i) / 10000.0f, s = 1.0f - t;
    const Vec3 q = s * s * s * b[0] + 3 * s * s * t * b[1] + 3 * s * t * t * b[2] + t * t * t * b[3];
    nearest = std::min(nearest, glm::distance(p, q));
  }
  return nearest;
}

TEST(Curve, StraightCurveIsATubeOfItsWidth) {
  for (const CurveType type : {CurveType::kFlat, CurveType::kCylinder}) {
    CurveParameters curve = curve_through(kStraight);
    curve.type = type;
    const Mesh mesh = tessellate_curve(curve);
    expect_sound(mesh);
    EXPECT_EQ(mesh.triangles.size(), 16u);
    for (const Vec3& p : mesh.positions) EXPECT_NEAR(std::hypot(p.x, p.y), 0.25f, 1e-6f);
    EXPECT_EQ(bounds_of(mesh.positions).lo.z, 0.0);
    EXPECT_EQ(bounds_of(mesh.positions).hi.z, 3.0);
  }
}

TEST(Curve, BentTubeFollowsItsCentreLine) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  for (const float width : {0.5f, 0.02f}) {
    const Mesh mesh = tessellate_curve(curve_through(kBent, width));
    expect_sound(mesh);
    for (const Vec3& p : mesh.positions) EXPECT_NEAR(distance_to(kBent, p), width / 2, 1e-3f);
    for (const Triangle& t : mesh.triangles) {
      const Vec3 middle = (mesh.positions[t.x] + mesh.positions[t.y] + mesh.positions[t.z]) / 3.0f;
      EXPECT_NEAR(distance_to(kBent, middle), width / 2, width / 20 + width / 20 + 1e-3f);
    }
  }
}

TEST(Curve, DegreesAndBasesDescribeTheSameParabola) {
  const std::vector<Vec3> quadratic{{0, 0, 0}, {1, 2, 0}, {2, 0, 0}};
  const std::vector<Vec3> cubic{{0, 0, 0}, {2 / 3.f, 4 / 3.f, 0}, {4 / 3.f, 4 / 3.f, 0}, {2, 0, 0}};
  const std::vector<Vec3> spline{{-1, -2, 0}, {1, 2, 0}, {3, -2, 0}}; // midpoints (0,0), (2,0)
  CurveParameters a = curve_through(quadratic), b = curve_through(cubic), c = curve_through(spline);
  a.degree = c.degree = 2;
  c.basis = CurveBasis::kBspline;
  const Mesh first = tessellate_curve(a);
  for (const Mesh& mesh : {tessellate_curve(b), tessellate_curve(c)}) {
    ASSERT_EQ(mesh.positions.size(), first.positions.size());
    for (size_t i = 0; i < mesh.positions.size(); ++i)
      EXPECT_LT(glm::distance(mesh.positions[i], first.positions[i]), 1e-5f);
  }
}

TEST(Curve, CubicSplineOfPointsOnALineIsTheLine) {
  const std::vector<Vec3> points{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}, {5, 0, 0}};
  CurveParameters curve = curve_through(points);
  curve.basis = CurveBasis::kBspline;
  const Mesh mesh = tessellate_curve(curve);
  EXPECT_NEAR(bounds_of(mesh.positions).lo.x, 1.0, 1e-6);
  EXPECT_NEAR(bounds_of(mesh.positions).hi.x, 4.0, 1e-6);
}

TEST(Curve, SegmentsJoinAndWidthsVaryOverAllOfThem) {
  const std::vector<Vec3> points{{0, 0, 0}, {0, 0, 1}, {0, 0, 2}, {0, 0, 3}, {0, 0, 4}, {0, 0, 5}, {0, 0, 6}};
  CurveParameters curve = curve_through(points);
  curve.width0 = 1.0f;
  curve.width1 = 0.0f;
  const Mesh mesh = tessellate_curve(curve);
  expect_sound(mesh);
  EXPECT_EQ(mesh.triangles.size(), 16u + 8u) << "the second segment ends in a point";
  for (const Vec3& p : mesh.positions) EXPECT_NEAR(std::hypot(p.x, p.y), 0.5f * (1.0f - p.z / 6.0f), 1e-6f);
}

TEST(Curve, RibbonFacesItsNormals) {
  CurveParameters curve = curve_through(kStraight);
  curve.type = CurveType::kRibbon;
  const std::vector<Vec3> normals{{0, 5, 0}, {0, 1, 0}};
  curve.normals = normals;
  const Mesh mesh = tessellate_curve(curve);
  expect_sound(mesh);
  EXPECT_EQ(mesh.triangles.size(), 2u);
  for (const Vec3& n : mesh.normals) EXPECT_EQ(n, Vec3(0, 1, 0));
  for (const Vec3& p : mesh.positions) EXPECT_EQ(std::abs(p.x), 0.25f);
}

TEST(Curve, RibbonTurnsWithItsNormals) {
  const std::vector<Vec3> normals{{0, 1, 0}, {1, 0, 0}};
  CurveParameters curve = curve_through(kBent);
  curve.type = CurveType::kRibbon;
  curve.normals = normals;
  const Mesh mesh = tessellate_curve(curve);
  EXPECT_GT(glm::dot(mesh.normals.front(), Vec3(0, 1, 0)), 0.999f);
  EXPECT_GT(glm::dot(mesh.normals.back(), Vec3(1, 0, 0)), 0.999f);
}

/// Number of edges, identified by positions, that belong to one triangle only.
size_t boundary_edge_count(const Mesh& mesh) {
  using Place = std::array<float, 3>;
  std::map<std::pair<Place, Place>, int> edges;
  const auto place = [&](uint32_t v) {
    const Vec3 p = mesh.positions[v];
    return Place{p.x, p.y, p.z};
  };
  for (const Triangle& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) ++edges[std::minmax(place(t[k]), place(t[(k + 1) % 3]))];
  return static_cast<size_t>(std::count_if(edges.begin(), edges.end(), [](const auto& e) { return e.second == 1; }));
}

TEST(Curve, TubesHaveNoCapsAndNoOtherHoles) {
  const std::vector<Vec3> wave{{0, 0, 0}, {1, 2, 0}, {2, -2, 1}, {3, 0, 0}, {4, 2, -1}, {5, -2, 0}, {6, 0, 0}};
  for (const CurveBasis basis : {CurveBasis::kBezier, CurveBasis::kBspline})
    for (const uint32_t degree : {2u, 3u})
      for (const CurveType type : {CurveType::kFlat, CurveType::kCylinder, CurveType::kRibbon})
        for (const float width1 : {0.3f, 0.1f}) {
          CurveParameters curve = curve_through(wave, 0.3f);
          curve.basis = basis;
          curve.degree = degree;
          curve.type = type;
          curve.width1 = width1;
          const std::vector<Vec3> normals((basis == CurveBasis::kBezier ? 6 / degree : 7 - degree) + 1, Vec3(0, 0, 1));
          if (type == CurveType::kRibbon) curve.normals = normals;
          const Mesh mesh = tessellate_curve(curve);
          ASSERT_FALSE(mesh.triangles.empty());
          EXPECT_TRUE(type == CurveType::kRibbon || boundary_edge_count(mesh) == 16u) << degree;
          for (const Vec3& n : mesh.normals) ASSERT_NEAR(glm::length(n), 1.0f, 1e-5f);
          EXPECT_EQ(mesh.uvs.front().x, 0.0f);
          EXPECT_EQ(mesh.uvs.back().x, 1.0f);
          // Widths are interpolated linearly in u.
          const size_t row = type == CurveType::kRibbon ? 2 : 9;
          for (size_t i = 0; i < mesh.positions.size(); i += row) {
            const Vec3 opposite = mesh.positions[i + row / 2];
            EXPECT_NEAR(glm::distance(mesh.positions[i], opposite), glm::mix(0.3f, width1, mesh.uvs[i].x), 1e-5f);
          }
        }
}

TEST(Curve, SplinesGoThroughTheirKnotPoints) {
  const std::vector<Vec3> p{{0, 0, 0}, {1, 2, 0}, {2, -2, 1}, {3, 0, 0}, {4, 2, -1}};
  for (const uint32_t degree : {2u, 3u}) {
    CurveParameters curve = curve_through(p, 0.1f);
    curve.basis = CurveBasis::kBspline;
    curve.degree = degree;
    const size_t segments = p.size() - degree;
    const Mesh mesh = tessellate_curve(curve);
    for (size_t s = 0; s <= segments; ++s) {
      // The uniform basis functions at a knot are 1/2, 1/2 or 1/6, 2/3, 1/6.
      const Vec3 knot = degree == 2 ? (p[s] + p[s + 1]) / 2.0f : (p[s] + 4.0f * p[s + 1] + p[s + 2]) / 6.0f;
      const float u = static_cast<float>(s) / static_cast<float>(segments);
      size_t found = 0;
      for (size_t i = 0; i < mesh.positions.size(); ++i)
        if (mesh.uvs[i].x == u) {
          EXPECT_NEAR(glm::distance(mesh.positions[i], knot), 0.05f, 1e-6f);
          ++found;
        }
      EXPECT_EQ(found, 9u) << s;
    }
  }
}

TEST(Curve, CornersKeepTheFullWidthOnBothSides) {
  const std::vector<Vec3> points{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {3, 1, 0}, {3, 2, 0}, {3, 3, 0}};
  const Mesh mesh = tessellate_curve(curve_through(points, 1.0f));
  EXPECT_EQ(boundary_edge_count(mesh), 16u);
  for (const Vec3& p : mesh.positions) {
    const bool first = p.y <= 0.5f && p.x <= 3.0f && std::abs(std::hypot(p.y, p.z) - 0.5f) < 1e-6f;
    const bool second = p.x >= 2.5f && p.y >= 0.0f && std::abs(std::hypot(p.x - 3, p.z) - 0.5f) < 1e-6f;
    EXPECT_TRUE(first || second) << p.x << " " << p.y << " " << p.z;
  }
}

TEST(Curve, BendsTighterThanTheWidthAreStillRound) {
  const std::vector<Vec3> hairpin{{0, 0, 0}, {0, 0, 10}, {1e-3f, 0, 10}, {1e-3f, 0, 0}};
  for (const float width : {2.0f, 0.5f}) {
    const Bounds box = bounds_of(tessellate_curve(curve_through(hairpin, width)).positions);
    EXPECT_LE(box.hi.z, 7.5 + width / 2 + 1e-5);
    EXPECT_GE(box.hi.z, 7.5 + width / 2 * 0.949 * 0.924 - width / 20) << "cos 18.4 degrees, cos(pi / 8)";
  }
}

TEST(Curve, ThinCurvesAreNotFollowedFinerThanFloatsAre) {
  for (const float width : {1e-3f, 1e-5f, 1e-6f, 1e-12f})
    EXPECT_LT(tessellate_curve(curve_through(kBent, width)).positions.size(), 9u * 7001u) << width;
  EXPECT_GT(tessellate_curve(curve_through(kBent, 1e-5f)).positions.size(), 9u * 1000u);
  std::vector<Vec3> long_curve;
  for (int i = 0; i < 3001; ++i) long_curve.emplace_back(i % 7, i % 5, i % 3);
  try {
    (void)tessellate_curve(curve_through(long_curve, 1e-12f));
    ADD_FAILURE() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kLimitExceeded);
  }
}

TEST(Curve, CoincidentControlPointsAreHarmless) {
  for (const std::vector<Vec3>& points : {std::vector<Vec3>{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {1, 1, 1}},
                                          {{0, 0, 0}, {0, 0, 0}, {1, 1, 1}, {1, 1, 1}},
                                          {{0, 0, 0}, {1, 0, 0}, {1, 0, 0}, {0, 0, 0}}}) {
    const Mesh mesh = tessellate_curve(curve_through(points, 0.1f));
    for (const Vec3& p : mesh.positions) ASSERT_TRUE(is_finite(p));
    for (const Vec3& n : mesh.normals) ASSERT_NEAR(glm::length(n), 1.0f, 1e-5f);
  }
}

TEST(Curve, WhatCannotBeDrawnIsAnError) {
  const std::vector<Vec3> point(4, Vec3(1.0f)), three(kStraight.begin(), kStraight.begin() + 3);
  EXPECT_THROW(tessellate_curve(curve_through(point)), Error);
  EXPECT_THROW(tessellate_curve(curve_through(three)), Error);
  EXPECT_THROW(tessellate_curve(curve_through({})), Error);
  EXPECT_THROW(tessellate_curve(curve_through(kStraight, 0.0f)), Error);
  EXPECT_THROW(tessellate_curve(curve_through(kStraight, -1.0f)), Error);
  EXPECT_THROW(tessellate_curve(curve_through(kStraight, std::numeric_limits<float>::quiet_NaN())), Error);
  std::vector<Vec3> bad = kStraight;
  bad[2].y = std::numeric_limits<float>::infinity();
  EXPECT_THROW(tessellate_curve(curve_through(bad)), Error);
  const std::vector<Vec3> huge{{0, 0, 0}, {3.4e38f, 0, 0}, {3.4e38f, 0, 0}, {3.4e38f, 3.4e38f, 0}};
  EXPECT_THROW(tessellate_curve(curve_through(huge, 1e38f)), Error) << "overflows";
  CurveParameters curve = curve_through(kStraight);
  curve.degree = 4;
  EXPECT_THROW(tessellate_curve(curve), Error);
  curve.degree = 3;
  curve.type = CurveType::kRibbon;
  EXPECT_THROW(tessellate_curve(curve), Error) << "no normals";
  const std::vector<Vec3> along{{0, 0, 1}, {0, 0, 1}}, zero{{0, 0, 0}, {0, 0, 1}};
  curve.normals = along;
  EXPECT_THROW(tessellate_curve(curve), Error) << "normals along the curve";
  curve.normals = zero;
  EXPECT_THROW(tessellate_curve(curve), Error);
}

} // namespace
} // namespace packtrace
