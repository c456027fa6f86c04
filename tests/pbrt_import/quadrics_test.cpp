#include <map>
#include <utility>

#include "pbrt_import/scene/bounds.h"
#include "tests/pbrt_import/quadric_cases.h"

namespace packtrace {
namespace {

using namespace quadric_test;

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

} // namespace
} // namespace packtrace
