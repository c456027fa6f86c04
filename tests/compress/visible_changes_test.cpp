// What cameras see of the source and of the scene on lattices.

#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "compress/bake/grid/narrow_gaps.h"
#include "compress/bake/grid/view_measure.h"
#include "compress/bake/grid/visible_changes.h"
#include "tests/compress/bake_checks.h"
#include "tests/compress/precision_scenes.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

using test::bake;
using test::camera_at;
using test::floor_mesh;
using test::step_of;

/// Boxes in one mesh, all turned about two axes.
class BoxMesh {
public:
  explicit BoxMesh(std::string name) { mesh_.name = std::move(name); }

  void add(DVec3 lo, DVec3 hi) {
    constexpr std::array<std::array<uint32_t, 4>, 6> kSides{
        {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}}};
    const auto first = static_cast<uint32_t>(mesh_.positions.size());
    for (uint32_t i = 0; i < 8; ++i) {
      const DVec3 p(i & 1 ? hi.x : lo.x, i & 2 ? hi.y : lo.y, i & 4 ? hi.z : lo.z);
      const double c = std::cos(0.3), s = std::sin(0.3), d = std::cos(0.2), t = std::sin(0.2);
      const DVec3 q(c * p.x - s * p.y, s * p.x + c * p.y, p.z);
      mesh_.positions.emplace_back(q.x, d * q.y - t * q.z, t * q.y + d * q.z);
    }
    for (const std::array<uint32_t, 4>& side : kSides) {
      mesh_.triangles.emplace_back(first + side[0], first + side[1], first + side[2]);
      mesh_.triangles.emplace_back(first + side[0], first + side[2], first + side[3]);
    }
  }
  Mesh take() { return std::move(mesh_); }

private:
  Mesh mesh_;
};

/// Horizontal plates of 100 x 100 units that are then tilted, in one mesh.
Mesh plates_mesh(double thickness, double gap, int count = 200) {
  BoxMesh boxes("plates");
  for (int i = 0; i < count; ++i) {
    const double y = (i - count / 2) * (thickness + gap);
    boxes.add({-50, y, -50}, {50, y + thickness, 50});
  }
  return boxes.take();
}

/// Slanted blades in a frame.
Mesh louvre_mesh() {
  BoxMesh boxes("louvre");
  for (int i = 0; i < 100; ++i) {
    const double y = 0.4 * i - 20.0;
    boxes.add({-40, y, -1}, {40, y + 0.05, 1});
  }
  boxes.add({-42, -22, -2}, {-40, 22, 2});
  boxes.add({40, -22, -2}, {42, 22, 2});
  return boxes.take();
}

/// Crossing bars before a wall.
Mesh grille_mesh() {
  BoxMesh boxes("grille");
  for (int i = -60; i < 60; ++i) {
    boxes.add({0.5 * i, -30, 0}, {0.5 * i + 0.2, 30, 0.2});
    boxes.add({-30, 0.5 * i, 0.2}, {30, 0.5 * i + 0.2, 0.4});
  }
  boxes.add({-30, -30, 3}, {30, 30, 4});
  return boxes.take();
}

Scene box_scene(Mesh mesh) {
  Scene scene = test::scene_of(std::move(mesh));
  scene.cameras.push_back(camera_at({0, 8, -130}, {0, 0, 0}));
  return scene;
}

/// Fraction of covered pixels in which the first camera sees another plate, or another of its sides, on the geometry's
/// lattice than in the source.
double changed_pixels(const Scene& scene, const BakedScene& baked) {
  const ScenePlan plan = plan_scene(scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  std::vector<GeometryGrid> grids(plan.geometries.size());
  for (uint32_t g = 0; g < grids.size(); ++g)
    grids[g].grid = {file.geometries()[g].step_mantissa, file.geometries()[g].step_exponent};
  const std::vector<uint32_t> instances{0};
  const VisiblePoints points =
      find_visible_points(PrimaryCamera(scene.cameras[0], kPromisedSize), PlacedParts(scene, plan, instances, grids));
  double seen = 0.0, changed = 0.0;
  for (size_t i = 0; i < points.source.size(); ++i) {
    if (points.source[i].geometry == baked::kNone && points.rounded[i].geometry == baked::kNone) continue;
    seen += 1.0;
    changed += points.source[i].triangle / 2 != points.rounded[i].triangle / 2; // two triangles per side of a box
  }
  EXPECT_GT(seen, 5000.0);
  return changed / seen;
}

TEST(DefaultPrecision, GapsAndPlatesWithinOneMeshCount) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  const std::array<Mesh, 8> meshes{
      plates_mesh(0.02, 0.08),     plates_mesh(0.1, 0.2),      plates_mesh(0.09, 0.01), plates_mesh(0.05, 0.05, 400),
      plates_mesh(0.02, 0.48, 60), plates_mesh(0.3, 0.02, 90), louvre_mesh(),           grille_mesh()};
  for (const Mesh& mesh : meshes) {
    const Scene scene = box_scene(mesh);
    const BakedScene baked = bake(scene);
    SCOPED_TRACE(mesh.name);
    EXPECT_LT(changed_pixels(scene, baked), 0.012);
    EXPECT_TRUE(baked.report.promise.empty());
  }
}

TEST(DefaultPrecision, PlatesFarBelowAPixelBreakThePromiseAloud) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  const Scene scene = box_scene(plates_mesh(0.001, 0.002, 3000));
  const BakedScene baked = bake(scene);
  ASSERT_FALSE(baked.report.promise.empty());
  EXPECT_EQ(baked.report.promise[0].bound, "outline");
  EXPECT_LT(baked.report.promise[0].wanted, baked.report.promise[0].step);
}

TEST(DefaultPrecision, StatedStepsThatMoveEdgesAreReported) {
  const BakedScene baked = bake(box_scene(plates_mesh(0.02, 0.08)), test::precision(PrecisionKind::kAbsolute, 0.02));
  ASSERT_FALSE(baked.report.promise.empty());
  EXPECT_EQ(baked.report.promise[0].bound, "outline");
  EXPECT_GT(baked.report.promise[0].wanted, 0.0001);
}

TEST(DefaultPrecision, HiddenPlatesNeedNoFinerGrid) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  const Scene shown = box_scene(plates_mesh(0.02, 0.08));
  Scene hidden = shown;
  BoxMesh cover("cover");
  for (const double side : {-1.0, 1.0}) {
    cover.add({52 * side - 1, -30, -53}, {52 * side + 1, 30, 53});
    cover.add({-53, -30, 52 * side - 1}, {53, 30, 52 * side + 1});
    cover.add({-53, 14 * side - 1, -53}, {53, 14 * side + 1, 53});
  }
  test::add_shape(hidden, cover.take());
  const double fine = step_of(BakedFile::from_bytes(bake(shown).bytes).geometries()[0]);
  EXPECT_GT(step_of(BakedFile::from_bytes(bake(hidden).bytes).geometries()[0]), 4.0 * fine);
}

/// Mean over the plates' gaps of |change of the width on the lattice| / width.
double mean_gap_change(const Mesh& plates, double gap, double step) {
  const auto side = [&](size_t box, size_t first, bool rounded) { // heights of two corners on an axis of the stack
    const DVec3 normal(-std::sin(0.3), std::cos(0.3) * std::cos(0.2), std::cos(0.3) * std::sin(0.2));
    double height = 0.0;
    for (const size_t corner : {first, first + 1, first + 4, first + 5}) {
      DVec3 p(plates.positions[8 * box + corner]);
      for (int axis = 0; rounded && axis < 3; ++axis) p[axis] = static_cast<double>(to_lattice(p[axis], step)) * step;
      height += glm::dot(p, normal) / 4.0;
    }
    return height;
  };
  const size_t count = plates.positions.size() / 8;
  double sum = 0.0;
  for (size_t box = 0; box + 1 < count; ++box) {
    EXPECT_NEAR(side(box + 1, 0, false) - side(box, 2, false), gap, 1e-4);
    sum += std::abs(side(box + 1, 0, true) - side(box, 2, true) - gap) / gap;
  }
  return sum / static_cast<double>(count - 1);
}

TEST(NarrowGaps, KeepTheirWidth) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  const Scene scene = box_scene(plates_mesh(0.3, 0.02, 90));
  const BakedScene baked = bake(scene);
  EXPECT_LT(mean_gap_change(scene.meshes[0], 0.02, step_of(BakedFile::from_bytes(baked.bytes).geometries()[0])), 0.025);
  EXPECT_TRUE(baked.report.promise.empty());
}

TEST(NarrowGaps, AreReportedIfAStatedStepChangesThem) {
  Scene scene = box_scene(plates_mesh(0.3, 0.02, 30));
  scene.cameras[0] = camera_at({0, 8, -53}, {0, 0, 0});
  const double step = step_of(BakedFile::from_bytes(bake(scene).bytes).geometries()[0]);
  const BakedScene baked = bake(scene, test::precision(PrecisionKind::kAbsolute, 2.0 * step));
  ASSERT_FALSE(baked.report.promise.empty());
  EXPECT_EQ(baked.report.promise[0].bound, "gap");
  EXPECT_LT(baked.report.promise[0].wanted, 2.0 * step);
}

TEST(NarrowGaps, AreFoundInFrontOfTheSurfaceOnly) {
  BoxMesh boxes("two plates");
  boxes.add({-4, 0.0, -4}, {4, 0.1, 4});
  boxes.add({-4, 0.2, -4}, {4, 0.3, 4});
  const Scene scene = test::scene_of(boxes.take());
  const ScenePlan plan = plan_scene(scene);
  const std::vector<uint32_t> instances{0};
  const std::vector<GeometryGrid> grids{{choose_position_grid(0.01), {}}};
  const PlacedParts parts(scene, plan, instances, grids);
  const auto point = [&](uint32_t triangle, double up) {
    const auto [a, b, c] = parts.corners(triangle, &PlacedParts::source_position);
    const DVec3 normal = glm::normalize(glm::cross(b - a, c - a));
    return VisiblePoint{0, triangle, 1.0, (a + b + c) / 3.0, normal.y * up > 0.0 ? normal : -normal};
  };
  // Triangles 4 and 5 of a box are its bottom, 6 and 7 its top (BoxMesh::add).
  const std::vector<VisiblePoint> points{point(6, 1.0), point(16, -1.0), point(18, 1.0), point(4, -1.0)};
  const std::vector<float> changes = measure_gap_changes(parts, {points, points});
  ASSERT_EQ(changes.size(), 4u);
  for (const size_t gap : {0u, 1u}) {
    EXPECT_GT(changes[gap], 0.0f);
    EXPECT_LT(changes[gap], 0.2f); // about 10 steps wide
  }
  EXPECT_EQ(changes[2], 0.0f);
  EXPECT_EQ(changes[3], 0.0f);
}

TEST(VisibleChanges, EnvironmentCamerasCount) {
  Scene scene = box_scene(plates_mesh(0.1, 0.2));
  scene.cameras[0].projection = Projection::kEnvironment;
  scene.cameras[0].world_from_camera = look_at({0, 8, -60}, {0, 0, 0}, {0, 1, 0}).value();
  const ScenePlan plan = plan_scene(scene);
  const std::vector<PrimaryCamera> cameras{PrimaryCamera(scene.cameras[0], kPromisedSize)};
  Progress progress;
  const VisibleChanges changes(scene, plan, measure_scene(scene, plan, progress), cameras, progress);
  const auto excess = [&](double step) {
    return changes.compare(std::vector<GeometryGrid>{{choose_position_grid(step), {}}})[0].excess();
  };
  EXPECT_GT(excess(0.2), 1.0);
  EXPECT_LE(excess(0.0005), 1.0);
}

TEST(VisibleSurface, ShowsTheNearestSurfaceOfEachPixelsRay) {
  Mesh mesh = floor_mesh(1e4f, -1.0f); // passes under the camera and behind it
  const Mesh sphere = test::sphere_mesh(24);
  const auto first = static_cast<uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), sphere.positions.begin(), sphere.positions.end());
  for (const Triangle& t : sphere.triangles) mesh.triangles.emplace_back(t.x + first, t.y + first, t.z + first);
  Scene scene = test::scene_of(mesh);
  const ScenePlan plan = plan_scene(scene);
  const std::vector<GeometryGrid> grids{{choose_position_grid(1e-7), {}}};
  const std::vector<uint32_t> instances{0};
  for (const Projection projection : {Projection::kPerspective, Projection::kOrthographic}) {
    Camera view = camera_at({0, 1, -5}, {0, 0, 0});
    view.projection = projection;
    const PrimaryCamera camera(view, {40, 30});
    const VisiblePoints points = find_visible_points(camera, PlacedParts(scene, plan, instances, grids));
    ASSERT_EQ(points.source.size(), 1200u);
    size_t of_sphere = 0;
    for (uint32_t i = 0; i < 1200; ++i) {
      const CameraRay ray = camera.ray(i % 40, i / 40);
      const VisiblePoint& point = points.source[i];
      const double b = glm::dot(ray.origin, ray.direction), c = glm::dot(ray.origin, ray.origin) - 1.0;
      const bool hits_sphere = b * b - c > 0.01, misses_sphere = b * b - c < -0.1;
      if (hits_sphere) {
        EXPECT_GE(point.triangle, 2u);
        EXPECT_NEAR(glm::length(point.position), 1.0, 0.02);
        ++of_sphere;
      } else if (misses_sphere && ray.direction.y < -0.001) {
        EXPECT_LT(point.triangle, 2u);
        EXPECT_NEAR(point.position.y, -1.0, 1e-6 * glm::length(point.position));
      } else if (misses_sphere && ray.direction.y > 0.0) {
        EXPECT_EQ(point.geometry, baked::kNone);
      }
      EXPECT_EQ(points.rounded[i].geometry, point.geometry);
    }
    EXPECT_GT(of_sphere, 20u);
  }
}

} // namespace
} // namespace packtrace
