#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "pbrt_import/shapes/subdivision.h"

/// Control meshes, and checks that hold for every subdivided mesh.
namespace packtrace::subdivision_test {

struct Control {
  std::vector<Vec3> points;
  std::vector<Triangle> triangles;
};

inline Control tetrahedron() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};
}

inline Control octahedron() {
  return {{{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
          {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}, {1, 0, 5}, {2, 1, 5}, {3, 2, 5}, {0, 3, 5}}};
}

/// n x n squares in the xy plane, all split along the same diagonal, so that inner vertices have valence 6. `height`
/// scales a random displacement in z.
inline Control grid(uint32_t n, float height = 0.0f) {
  Control control;
  std::mt19937 random(3);
  for (uint32_t y = 0; y <= n; ++y)
    for (uint32_t x = 0; x <= n; ++x)
      control.points.emplace_back(x, y, height * static_cast<float>(random() % 1000) / 1000.0f);
  for (uint32_t y = 0; y < n; ++y) {
    for (uint32_t x = 0; x < n; ++x) {
      const uint32_t a = y * (n + 1) + x, b = a + 1, c = a + n + 2, d = a + n + 1;
      control.triangles.emplace_back(a, b, c);
      control.triangles.emplace_back(a, c, d);
    }
  }
  return control;
}

/// A closed double pyramid over an n-gon: the apexes have valence n, the other vertices valence 4.
inline Control double_pyramid(uint32_t n) {
  Control control{{{0.1f, 0, 1}, {0, 0.1f, -2}}, {}};
  for (uint32_t i = 0; i < n; ++i) {
    const double angle = 2 * std::numbers::pi * i / n;
    control.points.emplace_back(std::cos(angle), 1.5 * std::sin(angle), 0.1 * (i % 3));
  }
  for (uint32_t i = 0; i < n; ++i) {
    const uint32_t a = 2 + i, b = 2 + (i + 1) % n;
    control.triangles.emplace_back(0, a, b);
    control.triangles.emplace_back(1, b, a);
  }
  return control;
}

/// An open fan of n triangles around point 0, which is at the boundary.
inline Control open_fan(uint32_t n) {
  Control control{{{0, 0, 0.2f}}, {}};
  for (uint32_t i = 0; i <= n; ++i) {
    const double angle = std::numbers::pi * i / n;
    control.points.emplace_back(std::cos(angle), std::sin(angle), 0.1 * (i % 2));
  }
  for (uint32_t i = 0; i < n; ++i) control.triangles.emplace_back(0, 1 + i, 2 + i);
  return control;
}

inline std::vector<std::string> g_messages;
inline void keep_message(Severity, uint32_t, std::string message) { g_messages.push_back(std::move(message)); }

inline Mesh subdivide(const Control& control, uint32_t levels) {
  g_messages.clear();
  return subdivide_loop(control.points, control.triangles, levels, keep_message);
}

/// Number of edges without an opposite edge; fails if an edge occurs twice in one direction.
inline size_t boundary_edge_count(const Mesh& mesh) {
  std::set<std::pair<uint32_t, uint32_t>> edges;
  for (const Triangle& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) EXPECT_TRUE(edges.insert({t[k], t[(k + 1) % 3]}).second);
  return static_cast<size_t>(
      std::count_if(edges.begin(), edges.end(), [&](auto e) { return !edges.count({e.second, e.first}); }));
}

inline void expect_sound(const Mesh& mesh) {
  ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
  EXPECT_TRUE(mesh.uvs.empty());
  for (const Vec3& p : mesh.positions) ASSERT_TRUE(is_finite(p));
  for (const Vec3& n : mesh.normals) ASSERT_NEAR(glm::length(n), 1.0f, 1e-5f);
  for (const Triangle& t : mesh.triangles) {
    ASSERT_TRUE(t.x < mesh.positions.size() && t.y < mesh.positions.size() && t.z < mesh.positions.size());
    ASSERT_TRUE(t.x != t.y && t.y != t.z && t.z != t.x);
  }
}

} // namespace packtrace::subdivision_test
