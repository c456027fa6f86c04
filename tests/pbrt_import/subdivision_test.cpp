#include "pbrt_import/shapes/subdivision.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <random>
#include <set>

#include <gtest/gtest.h>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Subdivider/Uniform/LoopT.hh>

#include "pbrt_import/scene/bounds.h"
#include "tests/pbrt_import/subdivision_controls.h"

namespace packtrace::subdivision_test {
namespace {

TEST(Subdivision, EachLevelHasFourTimesTheTriangles) {
  for (const Control& control : {tetrahedron(), octahedron(), double_pyramid(7), grid(3, 1.0f), open_fan(5)}) {
    size_t triangles = control.triangles.size();
    for (uint32_t levels = 0; levels <= 4; ++levels, triangles *= 4) {
      const Mesh mesh = subdivide(control, levels);
      expect_sound(mesh);
      EXPECT_EQ(mesh.triangles.size(), triangles);
      EXPECT_TRUE(g_messages.empty());
    }
  }
}

TEST(Subdivision, ClosedStaysClosedAndOpenKeepsItsBoundary) {
  for (uint32_t levels = 0; levels <= 3; ++levels) {
    const Mesh closed = subdivide(octahedron(), levels);
    EXPECT_EQ(boundary_edge_count(closed), 0u);
    EXPECT_EQ(closed.positions.size(), closed.triangles.size() / 2 + 2) << "Euler's formula for a sphere";
    EXPECT_EQ(boundary_edge_count(subdivide(grid(3, 1.0f), levels)), 12u << levels);
  }
}

TEST(Subdivision, ChildrenStayInTheirParentsPlaceAndOrientation) {
  const Mesh coarse = subdivide(octahedron(), 0), fine = subdivide(octahedron(), 3);
  for (size_t i = 0; i < fine.triangles.size(); ++i) {
    const auto centre = [](const Mesh& mesh, size_t t) {
      const Triangle v = mesh.triangles[t];
      return (mesh.positions[v.x] + mesh.positions[v.y] + mesh.positions[v.z]) / 3.0f;
    };
    const Triangle t = fine.triangles[i];
    const Vec3 c = centre(fine, i), parent = centre(coarse, i / 64);
    EXPECT_GT(
        glm::dot(c, glm::cross(fine.positions[t.y] - fine.positions[t.x], fine.positions[t.z] - fine.positions[t.x])),
        0.0f);
    for (int axis = 0; axis < 3; ++axis) EXPECT_GE(c[axis] * parent[axis], 0.0f) << "same octant";
    for (int k = 0; k < 3; ++k) EXPECT_GT(glm::dot(fine.normals[t[k]], c), 0.0f);
  }
}

std::vector<uint8_t> on_boundary(const Mesh& mesh) {
  std::set<std::pair<uint32_t, uint32_t>> edges;
  for (const Triangle& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) edges.insert({t[k], t[(k + 1) % 3]});
  std::vector<uint8_t> result(mesh.positions.size(), 0);
  for (const auto& [a, b] : edges)
    if (!edges.count({b, a})) result[a] = result[b] = 1;
  return result;
}

TEST(Subdivision, InteriorLimitsDoNotDependOnTheLevel) {
  for (const Control& control :
       {tetrahedron(), octahedron(), double_pyramid(5), double_pyramid(7), double_pyramid(20), grid(3, 1.0f)}) {
    const Mesh first = subdivide(control, 0);
    const std::vector<uint8_t> boundary = on_boundary(first);
    for (uint32_t levels = 1; levels <= 5; ++levels) {
      const Mesh mesh = subdivide(control, levels);
      for (size_t v = 0; v < control.points.size(); ++v) {
        if (boundary[v]) continue;
        EXPECT_LT(glm::distance(mesh.positions[v], first.positions[v]), 1e-6f) << v << " level " << levels;
        EXPECT_LT(glm::distance(mesh.normals[v], first.normals[v]), 1e-5f) << v << " level " << levels;
      }
    }
  }
}

TEST(Subdivision, BoundaryVerticesFollowPbrtsRules) {
  for (const uint32_t n : {1u, 2u, 3u, 4u, 9u}) {
    const Control fan = open_fan(n);
    const Vec3 first = fan.points[1], last = fan.points[n + 1], p = fan.points[0];
    EXPECT_LT(glm::distance(subdivide(fan, 0).positions[0], (first + 3.0f * p + last) / 5.0f), 1e-6f);
    const auto even = [](Vec3 a, Vec3 v, Vec3 b) { return (a + 6.0f * v + b) / 8.0f; };
    const Vec3 half_first = (p + first) / 2.0f, half_last = (p + last) / 2.0f;
    const Vec3 expected = (half_first + 3.0f * even(first, p, last) + half_last) / 5.0f;
    EXPECT_LT(glm::distance(subdivide(fan, 1).positions[0], expected), 1e-6f);
  }
  // Normals of flat fans, and tangents of a bent fan: the chord of the boundary and the middle edge.
  for (const uint32_t n : {1u, 2u, 3u, 4u, 9u}) {
    Control flat = open_fan(n);
    for (Vec3& p : flat.points) p.z = 0.0f;
    for (uint32_t levels = 0; levels <= 2; ++levels)
      for (const Vec3& normal : subdivide(flat, levels).normals)
        EXPECT_LT(glm::distance(normal, Vec3(0, 0, 1)), 1e-6f) << n;
  }
  const Control bent{{{0, 0, 0}, {1, 0, 0.5f}, {0, 1, 0.25f}, {-1, 0, 0}}, {{0, 1, 2}, {0, 2, 3}}};
  const Vec3 expected = glm::normalize(glm::cross(Vec3(2, 0, 0.5f), Vec3(0, 1, 0.25f)));
  EXPECT_LT(glm::distance(subdivide(bent, 0).normals[0], expected), 1e-6f);
}

TEST(Subdivision, NormalsAreThoseOfTheFineSurface) {
  for (const Control& control : {octahedron(), double_pyramid(7), grid(3, 0.3f)}) {
    const Mesh fine = subdivide(control, 6);
    std::vector<DVec3> sums(fine.positions.size(), DVec3(0.0));
    for (const Triangle& t : fine.triangles) {
      const DVec3 p0(fine.positions[t.x]), p1(fine.positions[t.y]), p2(fine.positions[t.z]);
      for (int k = 0; k < 3; ++k) sums[t[k]] += glm::cross(p1 - p0, p2 - p0);
    }
    double worst = 1.0;
    for (size_t v = 0; v < sums.size(); ++v)
      worst = std::min(worst, glm::dot(glm::normalize(sums[v]), DVec3(fine.normals[v])));
    EXPECT_GT(worst, 0.99);
  }
}

TEST(Subdivision, RegularFlatPatchesReproducePositions) {
  const Mesh mesh = subdivide(grid(4), 1);
  for (uint32_t y = 1; y < 4; ++y)
    for (uint32_t x = 1; x < 4; ++x)
      EXPECT_LT(glm::distance(mesh.positions[y * 5 + x], Vec3(x, y, 0)), 1e-6f) << "linear precision";
  for (const Vec3& n : mesh.normals) EXPECT_EQ(n, Vec3(0, 0, 1));
}

TEST(Subdivision, BoundaryCurveDependsOnTheBoundaryAlone) {
  Control bumped = grid(4);
  for (uint32_t y = 1; y < 4; ++y)
    for (uint32_t x = 1; x < 4; ++x) bumped.points[y * 5 + x].z = 3.0f;
  std::set<std::pair<float, float>> flat_edge, bumped_edge;
  for (const Vec3& p : subdivide(grid(4), 3).positions)
    if (p.y == 0.0f) flat_edge.insert({p.x, p.z});
  for (const Vec3& p : subdivide(bumped, 3).positions)
    if (p.y == 0.0f) bumped_edge.insert({p.x, p.z});
  EXPECT_GE(flat_edge.size(), 17u);
  EXPECT_EQ(flat_edge, bumped_edge);
}

/// Compares with OpenMesh, which uses pbrt's weights at vertices of valence 3 and 6, and at boundaries while refining.
void expect_agreement_with_openmesh(const Control& control) {
  using Oracle = OpenMesh::TriMesh_ArrayKernelT<>;
  Oracle oracle;
  for (const Vec3& p : control.points) oracle.add_vertex({p.x, p.y, p.z});
  const auto handle = [](uint32_t i) { return Oracle::VertexHandle(static_cast<int>(i)); };
  for (const Triangle& t : control.triangles) oracle.add_face(handle(t.x), handle(t.y), handle(t.z));
  OpenMesh::Subdivider::Uniform::LoopT<Oracle> loop;
  loop.attach(oracle);
  loop(2);
  const size_t coarse_count = oracle.n_vertices();
  loop(5); // the vertices of two levels keep their handles and converge to the limit
  loop.detach();
  const Mesh mesh = subdivide(control, 2);
  ASSERT_EQ(mesh.positions.size(), coarse_count);
  const std::vector<uint8_t> boundary = on_boundary(mesh); // pbrt uses a different limit at the boundary
  std::vector<uint8_t> matched(coarse_count, 0);
  for (size_t v = 0; v < coarse_count; ++v) {
    if (boundary[v]) continue;
    const Vec3 p = mesh.positions[v];
    size_t best = 0;
    float best_distance = std::numeric_limits<float>::infinity();
    for (size_t i = 0; i < coarse_count; ++i) {
      const auto& q = oracle.point(handle(static_cast<uint32_t>(i)));
      const float distance = glm::distance(p, Vec3(q[0], q[1], q[2]));
      if (distance < best_distance) best = i, best_distance = distance;
    }
    EXPECT_LT(best_distance, 2e-4f);
    EXPECT_EQ(matched[best]++, 0);
  }
}

TEST(Subdivision, AgreesWithOpenMesh) {
  expect_agreement_with_openmesh(tetrahedron());
  expect_agreement_with_openmesh(grid(3, 1.0f));
}

TEST(Subdivision, LimitsAreTheMasksOfTheirValence) {
  // The apex of a pyramid over a ring at height 0 moves to 1 - n gamma of its height, gamma = 1 / (n + 3 / (8 beta)).
  for (const uint32_t n : {3u, 4u, 5u, 6u, 7u, 20u, 64u, 1000u}) {
    Control control = double_pyramid(n);
    control.points[0] = {0, 0, 1};
    for (size_t i = 2; i < control.points.size(); ++i) control.points[i].z = 0.0f;
    const float expected = n == 3 ? 0.4f : 0.5f; // beta is 3 / 16 for n = 3, else 3 / (8 n)
    for (uint32_t levels = 0; levels <= 3; ++levels) {
      const Mesh mesh = subdivide(control, levels);
      EXPECT_NEAR(mesh.positions[0].z, expected, 1e-6f) << n;
      EXPECT_GT(mesh.normals[0].z, 0.99f) << n;
    }
  }
}

std::vector<float> numbers_after(const std::string& text, const std::string& name) {
  std::vector<float> numbers;
  const char* p = text.c_str() + text.find('[', text.find(name)) + 1;
  for (char* end = nullptr;; p = end) {
    const float value = std::strtof(p, &end);
    if (end == p) return numbers;
    numbers.push_back(value);
  }
}

TEST(Subdivision, KillerooHasItsReferenceTriangleCount) {
  const char* const scenes = std::getenv("PACKTRACE_SCENES");
  if (!scenes) GTEST_SKIP() << "PACKTRACE_SCENES is not set";
  std::ifstream stream(std::filesystem::path(scenes) / "killeroo/geometry/killeroo.pbrt");
  const std::string text(std::istreambuf_iterator<char>(stream), {});
  const std::vector<float> p = numbers_after(text, "\"point P\""), indices = numbers_after(text, "\"integer indices\"");
  Control control;
  for (size_t i = 0; i + 2 < p.size(); i += 3) control.points.emplace_back(p[i], p[i + 1], p[i + 2]);
  for (size_t i = 0; i + 2 < indices.size(); i += 3)
    control.triangles.emplace_back(indices[i], indices[i + 1], indices[i + 2]);
  ASSERT_EQ(control.triangles.size(), 8316u);
  const Mesh mesh = subdivide(control, 1);
  expect_sound(mesh);
  EXPECT_EQ(mesh.triangles.size(), (66533u - 5u) / 2u);
  EXPECT_TRUE(g_messages.empty());
  const Bounds control_box = bounds_of(control.points), box = bounds_of(mesh.positions);
  EXPECT_EQ(glm::min(control_box.lo, box.lo), control_box.lo);
  EXPECT_EQ(glm::max(control_box.hi, box.hi), control_box.hi);
}

} // namespace
} // namespace packtrace::subdivision_test
