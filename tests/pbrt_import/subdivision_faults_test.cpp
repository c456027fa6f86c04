// Tests the subdivision of non-manifold control meshes, and its limits.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "tests/pbrt_import/subdivision_controls.h"

namespace packtrace::subdivision_test {
namespace {

TEST(Subdivision, ThreeTrianglesAtAnEdgeAreKeptAndReported) {
  const Control book{{{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {-1, 1, 0}, {-1, -1, 0}}, {{0, 1, 2}, {0, 1, 3}, {1, 0, 4}}};
  const Mesh mesh = subdivide(book, 3);
  expect_sound(mesh);
  EXPECT_EQ(mesh.triangles.size(), 3u * 64u);
  EXPECT_EQ(boundary_edge_count(mesh), 3u * 3u * 8u) << "three separate sheets";
  ASSERT_EQ(g_messages.size(), 1u);
  EXPECT_NE(g_messages[0].find("1 edges"), std::string::npos);
}

TEST(Subdivision, SurfacesCutAlongACurveStayTogetherThere) {
  // Three strips that share a polyline; their boundaries along it are the same curve.
  Control strips;
  for (int i = 0; i < 6; ++i) strips.points.emplace_back(0.1 * (i % 2), 0, i);
  for (uint32_t s = 0; s < 3; ++s) {
    const double angle = 2.0 * std::numbers::pi * s / 3;
    const auto first = static_cast<uint32_t>(strips.points.size());
    for (int i = 0; i < 6; ++i) strips.points.emplace_back(std::cos(angle), std::sin(angle), i);
    for (uint32_t i = 0; i < 5; ++i) {
      strips.triangles.emplace_back(i, i + 1, first + i);
      strips.triangles.emplace_back(i + 1, first + i + 1, first + i);
    }
  }
  const Mesh mesh = subdivide(strips, 2);
  expect_sound(mesh);
  EXPECT_EQ(mesh.triangles.size(), 30u * 16u);
  std::map<std::array<float, 3>, int> places;
  for (const Vec3& p : mesh.positions) ++places[{p.x, p.y, p.z}];
  // Points of the curve away from its ends, 17 of 21, are shared by all strips; the ends are corners of each strip and
  // have other neighbours.
  EXPECT_GE(std::count_if(places.begin(), places.end(), [](const auto& place) { return place.second == 3; }), 13);
}

TEST(Subdivision, FansThatShareOnlyAPointAreSplit) {
  const Control bow_tie{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {-1, 0, 0}, {-1, -1, 0}}, {{0, 1, 2}, {0, 3, 4}}};
  const Mesh mesh = subdivide(bow_tie, 2);
  expect_sound(mesh);
  EXPECT_EQ(mesh.triangles.size(), 32u);
  ASSERT_EQ(g_messages.size(), 1u);
  EXPECT_NE(g_messages[0].find("1 points"), std::string::npos);
}

TEST(Subdivision, HostileTopologyLosesNoTriangle) {
  const Control moebius{{{0, 0, 0}, {1, 0, 0}, {2, 1, 0}, {1, 2, 1}, {0, 2, 0}},
                        {{0, 1, 2}, {1, 3, 2}, {2, 3, 4}, {3, 0, 4}, {4, 0, 1}}};
  const Control disagreeing{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}, {{0, 1, 2}, {1, 2, 3}}};
  const Control twice{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 1, 2}, {1, 2, 0}}};
  const Control pillow{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 1}}};
  const Control flat{std::vector<Vec3>(3, Vec3(2.0f)), {{0, 1, 2}}};
  for (const Control& control : {moebius, disagreeing, twice, pillow, flat, double_pyramid(3000)}) {
    const Mesh mesh = subdivide(control, 2);
    expect_sound(mesh);
    EXPECT_EQ(mesh.triangles.size(), control.triangles.size() * 16);
  }
  std::mt19937 random(11);
  for (int round = 0; round < 200; ++round) {
    Control soup;
    for (int i = 0; i < 8; ++i) soup.points.emplace_back(random() % 10, random() % 10, random() % 10);
    for (int i = 0; i < 12; ++i) {
      const uint32_t a = random() % 8, b = (a + 1 + random() % 3) % 8, c = (a + 4 + random() % 4) % 8;
      soup.triangles.emplace_back(a, b, c);
    }
    const Mesh mesh = subdivide(soup, 2);
    expect_sound(mesh);
    EXPECT_EQ(mesh.triangles.size(), 12u * 16u);
    boundary_edge_count(mesh);
  }
}

TEST(Subdivision, WorkCanBeCancelledBetweenLevels) {
  uint32_t calls = 0;
  const CheckCancelledFn check = [&] {
    if (++calls == 3) throw Error(ErrorKind::kCancelled, "stop");
  };
  const Control control = octahedron();
  EXPECT_THROW(subdivide_loop(control.points, control.triangles, 5, {}, nullptr, check), Error);
  EXPECT_EQ(calls, 3u);
}

TEST(Subdivision, BadTrianglesAreDroppedAndReported) {
  Control control = octahedron();
  control.points.push_back({std::numeric_limits<float>::quiet_NaN(), 0, 0});
  control.triangles.insert(control.triangles.end(), {{0, 1, 99}, {0, 0, 1}, {0, 1, 6}});
  g_messages.clear();
  uint64_t dropped = 10;
  const Mesh mesh = subdivide_loop(control.points, control.triangles, 1, keep_message, &dropped);
  EXPECT_EQ(dropped, 13u);
  EXPECT_EQ(mesh.triangles.size(), 32u);
  EXPECT_EQ(boundary_edge_count(mesh), 0u);
  EXPECT_EQ(g_messages.size(), 3u);
}

TEST(Subdivision, ResultsBeyondTheBudgetAreRejectedBeforeAllocating) {
  for (const uint32_t levels : {13u, 30u, 4294967295u}) {
    try {
      subdivide(octahedron(), levels);
      FAIL() << levels;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kLimitExceeded);
    }
  }
}

TEST(Subdivision, NothingGivesNothing) {
  EXPECT_TRUE(subdivide({}, 4294967295u).triangles.empty());
  EXPECT_TRUE(subdivide({{{0, 0, 0}}, {{0, 1, 2}}}, 3).triangles.empty());
}

} // namespace
} // namespace packtrace::subdivision_test
