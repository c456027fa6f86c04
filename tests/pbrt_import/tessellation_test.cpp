// Common properties of all shapes: their orientation, and that they depend on their parameters only.
#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/shapes/curve.h"
#include "pbrt_import/shapes/heightfield.h"
#include "pbrt_import/shapes/nurbs.h"
#include "pbrt_import/shapes/quadrics.h"
#include "pbrt_import/shapes/subdivision.h"
#include "tests/pbrt_import/scene_folder.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

/// Geometric normal of a triangle in its parent's space, not normalised, as defined in scene.h.
DVec3 geometric_normal(const Scene& scene, const Shape& shape, const Triangle& t) {
  const DVec3 a = placed(shape, scene, t.x), b = placed(shape, scene, t.y), c = placed(shape, scene, t.z);
  const bool negated = shape.reverse_orientation != swaps_handedness(shape.parent_from_mesh);
  return glm::cross(b - a, c - a) * (negated ? -1.0 : 1.0);
}

TEST(Tessellation, QuadricsFaceWherePbrtSays) {
  const struct {
    const char* shape;
    std::function<DVec3(DVec3)> facing; ///< cross(dp/du, dp/dv) at a point of the shape
  } cases[] = {
      {R"("sphere")", [](DVec3 p) { return p; }},
      {R"("sphere" "float zmin" -0.5 "float zmax" 0.25 "float phimax" 200)", [](DVec3 p) { return p; }},
      {R"("cylinder")", [](DVec3 p) { return DVec3(p.x, p.y, 0); }},
      {R"("disk" "float innerradius" 0.25)", [](DVec3) { return DVec3(0, 0, 1); }},
      {R"("cone")", [](DVec3 p) { return DVec3(p.x, p.y, 0.3); }},
      {R"("paraboloid" "float zmin" 0.1)", [](DVec3 p) { return DVec3(p.x, p.y, -0.1); }},
      {R"("hyperboloid" "point p1" [1 0 -1] "point p2" [1 0.5 1])", [](DVec3 p) { return DVec3(p.x, p.y, 0); }},
  };
  const SceneFolder folder;
  ImportOptions options;
  options.tessellation_tolerance = 0.02;
  for (const auto& c : cases)
    for (const char* const transform : {"", "Scale -1 1 1 ", "Scale 1 1 -2 ", "Rotate 30 1 2 3 Scale 1 -3 1 "})
      for (const bool reversed : {false, true}) {
        const std::string text = transform + std::string(reversed ? "ReverseOrientation " : "") + "Shape " + c.shape;
        const Imported imported = import_world(folder, text, options);
        ASSERT_EQ(imported.scene.shapes.size(), 1u) << imported.text();
        const Shape& shape = imported.scene.shapes[0];
        const Mesh& mesh = imported.scene.meshes[shape.mesh];
        const glm::dmat3 normal_from_mesh = normal_matrix(shape.parent_from_mesh);
        for (const Triangle& t : mesh.triangles) {
          const DVec3 middle =
              (DVec3(mesh.positions[t.x]) + DVec3(mesh.positions[t.y]) + DVec3(mesh.positions[t.z])) / 3.0;
          // In pbrt mirroring does not flip normals: they are transformed as normals, then negated if the shape is
          // reversed.
          const DVec3 expected = normal_from_mesh * c.facing(middle) * (reversed ? -1.0 : 1.0);
          ASSERT_GT(glm::dot(geometric_normal(imported.scene, shape, t), expected), 0.0) << text;
          for (int k = 0; k < 3; ++k) ASSERT_GT(glm::dot(DVec3(mesh.normals[t[k]]), c.facing(middle)), 0.0) << text;
        }
      }
}

std::vector<std::function<Mesh()>> one_of_each() {
  static const std::vector<Vec3> points{{0, 0, 0}, {0, 0, 4}, {4, 0, 4}, {4, 4, 4}}, normals{{0, 1, 0}, {1, 0, 0}};
  static const std::vector<Triangle> triangles{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  static const std::vector<float> knots{0, 0, 1, 1}, heights{0, 1, 2, 3, 2, 1};
  static const std::vector<glm::vec4> control{{0, 0, 0, 1}, {1, 0, 1, 1}, {0, 1, 1, 1}, {1, 1, 0, 2}};
  const auto make_curve = [](CurveType type) {
    CurveParameters curve;
    curve.type = type;
    curve.points = points;
    curve.normals = normals;
    return tessellate_curve(curve);
  };
  return {
      [] { return tessellate_sphere({}, 1e-3); },
      [] { return tessellate_cylinder({}, 1e-3); },
      [] { return tessellate_disk({}, 1e-3); },
      [] { return tessellate_cone({}, 1e-3); },
      [] { return tessellate_paraboloid({}, 1e-3); },
      [] { return tessellate_hyperboloid({{1, 0, -1}, {0, 1, 1}, 360}, 1e-3); },
      [=] { return make_curve(CurveType::kFlat); },
      [=] { return make_curve(CurveType::kCylinder); },
      [=] { return make_curve(CurveType::kRibbon); },
      [] { return subdivide_loop(points, triangles, 4, {}); },
      [] { return tessellate_nurbs({2, 2, 2, 2, knots, knots, {}, {}, {}, {}, control}, 1e-3); },
      [] { return make_heightfield(3, 2, heights); },
  };
}

TEST(Tessellation, SameParametersGiveTheSameTrianglesOnAnyThread) {
  const auto shapes = one_of_each();
  std::vector<Mesh> alone;
  for (const auto& make : shapes) alone.push_back(make());
  std::vector<std::vector<Mesh>> together(4);
  std::vector<std::thread> threads;
  for (std::vector<Mesh>& meshes : together)
    threads.emplace_back([&] {
      for (const auto& make : shapes) meshes.push_back(make());
    });
  for (std::thread& thread : threads) thread.join();
  for (const std::vector<Mesh>& meshes : together)
    for (size_t i = 0; i < shapes.size(); ++i) {
      EXPECT_FALSE(meshes[i].triangles.empty());
      EXPECT_EQ(meshes[i].positions, alone[i].positions) << i;
      EXPECT_EQ(meshes[i].normals, alone[i].normals) << i;
      EXPECT_EQ(meshes[i].uvs, alone[i].uvs) << i;
      EXPECT_EQ(meshes[i].triangles, alone[i].triangles) << i;
    }
}

void expect_contract(const Mesh& mesh, const std::string& what) {
  ASSERT_TRUE(mesh.normals.empty() || mesh.normals.size() == mesh.positions.size()) << what;
  ASSERT_TRUE(mesh.uvs.empty() || mesh.uvs.size() == mesh.positions.size()) << what;
  for (const Vec3& p : mesh.positions) ASSERT_TRUE(is_finite(p)) << what;
  for (const Vec3& n : mesh.normals) ASSERT_NEAR(glm::length(n), 1.0f, 1e-5f) << what;
  for (const Vec2& uv : mesh.uvs) ASSERT_TRUE(std::isfinite(uv.x) && std::isfinite(uv.y)) << what;
  for (const Triangle& t : mesh.triangles) {
    ASSERT_LT(std::max({t.x, t.y, t.z}), mesh.positions.size()) << what;
    const Vec3 a = mesh.positions[t.x], b = mesh.positions[t.y], c = mesh.positions[t.z];
    ASSERT_TRUE(a != b && b != c && c != a) << what;
  }
}

TEST(Tessellation, KeepsTheContractOfMeshes) {
  for (const auto& make : one_of_each()) expect_contract(make(), "one of each");
}

/// Random numbers, problematic and ordinary ones.
class Numbers {
public:
  explicit Numbers(uint32_t seed) : random_(seed) {}
  float operator()() {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    constexpr float kSpecial[] = {0.0f,   -0.0f,   1.0f,     -1.0f,       0.5f,
                                  2.0f,   1e-45f,  1e-38f,   1e-30f,      1e30f,
                                  -1e30f, 3.4e38f, -3.4e38f, 0.99999994f, 1.0000001f,
                                  360.0f, 90.0f,   1e-6f,    kInfinity,   std::numeric_limits<float>::quiet_NaN()};
    if (random_() % 3 == 0) return kSpecial[random_() % std::size(kSpecial)];
    return static_cast<float>(static_cast<int>(random_() % 4001) - 2000) / 1000.0f;
  }
  uint32_t below(uint32_t bound) { return static_cast<uint32_t>(random_() % bound); }
  Vec3 vector() {
    const float x = (*this)(), y = (*this)(), z = (*this)();
    return {x, y, z};
  }

private:
  std::mt19937 random_;
};

TEST(Tessellation, AnyNumbersGiveAnErrorOrASoundMesh) {
  const std::function<Mesh(Numbers&)> kinds[] = {
      [](Numbers& x) { return tessellate_sphere({x(), x(), x(), x() * 300}, 0.05); },
      [](Numbers& x) { return tessellate_cylinder({x(), x(), x(), x() * 300}, 0.05); },
      [](Numbers& x) { return tessellate_disk({x(), x(), x(), x() * 300}, 0.05); },
      [](Numbers& x) { return tessellate_cone({x(), x(), x() * 300}, 0.05); },
      [](Numbers& x) { return tessellate_paraboloid({x(), x(), x(), x() * 300}, 0.05); },
      [](Numbers& x) { return tessellate_hyperboloid({x.vector(), x.vector(), x() * 300}, 0.05); },
      [](Numbers& x) {
        std::vector<Vec3> points(3 + x.below(6)), normals(2 + x.below(3));
        for (Vec3& p : points) p = x.vector();
        for (Vec3& n : normals) n = x.vector();
        return tessellate_curve({static_cast<CurveType>(x.below(3)), static_cast<CurveBasis>(x.below(2)),
                                 2 + x.below(2), x(), x(), points, normals});
      },
      [](Numbers& x) {
        NurbsParameters nurbs;
        nurbs.nu = 2 + x.below(3), nurbs.nv = 2 + x.below(3);
        nurbs.u_order = 2 + x.below(2), nurbs.v_order = 2 + x.below(2);
        std::vector<float> u_knots(nurbs.nu + nurbs.u_order), v_knots(nurbs.nv + nurbs.v_order);
        for (std::vector<float>* knots : {&u_knots, &v_knots}) {
          for (float& k : *knots) k = x();
          std::sort(knots->begin(), knots->end(),
                    [](float a, float b) { return a < b || (std::isnan(b) && !std::isnan(a)); });
        }
        std::vector<glm::vec4> points(size_t{nurbs.nu} * nurbs.nv);
        for (glm::vec4& p : points) p = {x.vector(), x.below(4) ? 1.0f : x()};
        nurbs.u_knots = u_knots, nurbs.v_knots = v_knots, nurbs.control_points = points;
        return tessellate_nurbs(nurbs, 0.1);
      },
  };
  const uint32_t seeds = test::fewer(1000u);
  for (size_t kind = 0; kind < std::size(kinds); ++kind) {
    size_t meshes = 0;
    for (uint32_t seed = 0; seed < seeds; ++seed) {
      Numbers numbers(seed * 8 + static_cast<uint32_t>(kind));
      Mesh mesh;
      try {
        mesh = kinds[kind](numbers);
      } catch (const Error& error) {
        ASSERT_TRUE(error.kind() == ErrorKind::kInput || error.kind() == ErrorKind::kLimitExceeded) << error.what();
        continue;
      }
      ++meshes;
      expect_contract(mesh, "kind " + std::to_string(kind) + " seed " + std::to_string(seed));
      if (HasFatalFailure()) return;
    }
    EXPECT_GT(meshes, test::fewer(20u)) << "kind " << kind << ": most are refused, but not all";
  }
}

TEST(Tessellation, SkippedAndMendedShapesAreReportedWithTheirPlace) {
  const SceneFolder folder;
  const std::string knots = "\"float uknots\" [0 0 1 1] \"float vknots\" [0 0 1 1] ";
  const Imported imported = import_world(
      folder, "Shape \"hyperboloid\" \"point p1\" [1 0 2] \"point p2\" [2 0 2]\n"
              "Shape \"sphere\" \"float radius\" -1\n"
              "Shape \"curve\" \"point P\" [0 0 0 1 0 0 2 0 0]\n"
              "Shape \"nurbs\" \"integer nu\" 2 \"integer nv\" 2 \"integer uorder\" 2 \"integer vorder\" 2 " +
                  knots + "\"float Pw\" [0 0 0 1  1 0 0 1  0 1 0 1  1 1 0 -1]\n" +
                  "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 1 3] \"point P\" [0 0 0 1 0 0 0 1 0]\n");
  EXPECT_EQ(imported.scene.shapes.size(), 1u);
  EXPECT_EQ(imported.statistics.shapes_skipped, 4u);
  EXPECT_EQ(imported.scene.dropped_triangles, 1u);
  EXPECT_TRUE(imported.reported("1:12: error: Shape \"hyperboloid\" is skipped: the hyperboloid's p1 and p2 are at the "
                                "same height"))
      << imported.text();
  EXPECT_TRUE(imported.reported("2:1: error: Shape \"sphere\" is skipped: the sphere's radius is not positive"));
  EXPECT_TRUE(
      imported.reported("3:1: error: Shape \"curve\" is skipped: 3 control points do not make curve segments of "
                        "degree 3"));
  EXPECT_TRUE(imported.reported("4:1: error: Shape \"nurbs\" is skipped: the nurbs surface runs through infinity"));
  EXPECT_TRUE(
      imported.reported("5:1: warning: trianglemesh: 1 triangle (number 1) dropped: vertex index out of range"));
}

} // namespace
} // namespace packtrace
