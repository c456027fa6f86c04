#include "runtime/trace/packed/scene/mesh_motion.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "runtime/camera/deformed_past.h"
#include "tests/deforming_meshes.h"
#include "tests/runtime/trace/packed_scenes.h"

namespace packtrace {
namespace {

using test::BakedScene;
using test::closest;
using test::random_rays;

constexpr uint32_t kFrames = 12;
const Bounds kAround{{-0.2, -0.2, -0.5}, {1.2, 1.2, 0.5}};

/// A cloth that moves, placed twice, and a floor.
Scene cloth_scene(const test::DeformingMesh& cloth, double time) {
  Scene scene;
  const uint32_t shape = test::add_shape(scene, cloth.mesh(time));
  scene.shapes.push_back(scene.shapes[shape]);
  scene.shapes.back().parent_from_mesh = test::placed({0, 0, 0.3}, DVec3(1, 1, -1), 20);
  test::add_shape(scene, test::quad({-1, -0.1f, -1}, {0, 0, 3}, {3, 0, 0}));
  return scene;
}

BakeConfig moving_config(const test::DeformingMesh& cloth) {
  BakeConfig config;
  config.precision_kind = PrecisionKind::kAbsolute, config.precision = 1e-4;
  config.sequences.push_back({0, std::make_shared<test::GivenFrames>(test::sampled(cloth, kFrames)), 24.0, 0});
  return config;
}

TEST(MeshMotion, EachTimeIsHitLikeAFileBakedFromItsFrame) {
  const test::Cloth cloth(30);
  const BakedScene moving(cloth_scene(cloth, 0.0), moving_config(cloth));
  MeshMotion motion(moving.file);
  ASSERT_EQ(motion.geometries().size(), 1u);
  EXPECT_DOUBLE_EQ(motion.duration(), (kFrames - 1) / 24.0);
  PackedTracer tracer(moving.file, moving.source, motion.geometries());
  BakeConfig still_config = moving_config(cloth);
  still_config.sequences.clear();
  for (const uint32_t frame : {0u, 1u, 2u, 7u, 8u, 11u, 3u}) {
    EXPECT_EQ(motion.set_time(frame / 24.0, false, tracer).moved, frame != 0);
    const BakedScene alone(cloth_scene(cloth, frame / 24.0), still_config);
    const PackedTracer fresh(alone.file, alone.source);
    const std::vector<RayHit> hits = closest(tracer, random_rays(5000, kAround, tracer.space(), frame)),
                              expected = closest(fresh, random_rays(5000, kAround, fresh.space(), frame));
    size_t found = 0, different = 0;
    for (size_t i = 0; i < hits.size(); ++i) {
      found += hits[i].valid();
      // Both clothes lie on grids of their own, whose steps may differ.
      different +=
          hits[i].valid() != expected[i].valid() || (hits[i].valid() && std::abs(hits[i].t - expected[i].t) > 2e-3);
    }
    EXPECT_GT(found, 1500u);
    EXPECT_LE(different, found / 100) << frame;
  }
}

/// Largest distance between the current and the previous vertices of what rays hit, in the surfaces' coordinates.
double largest_step(const PackedTracer& tracer) {
  double largest = 0.0;
  for (const RayHit& hit : closest(tracer, random_rays(3000, kAround, tracer.space(), 1))) {
    if (!hit.valid()) continue;
    const HitSurface surface = tracer.resolve(hit);
    Vec3 before[3];
    tracer.previous_vertices(hit, before);
    for (int corner = 0; corner < 3; ++corner)
      largest = std::max(largest, glm::distance(DVec3(before[corner]), DVec3(surface.vertices[corner])));
  }
  return largest;
}

TEST(MeshMotion, VerticesThatStayHaveNoMotion) {
  const test::Cloth cloth(10);
  const BakedScene moving(cloth_scene(cloth, 0.0), moving_config(cloth));
  MeshMotion motion(moving.file);
  PackedTracer tracer(moving.file, moving.source, motion.geometries());
  EXPECT_EQ(largest_step(tracer), 0.0);
  EXPECT_FALSE(motion.set_time(0.0, true, tracer).moved);
  EXPECT_TRUE(motion.set_time(0.1, true, tracer).moved);
  EXPECT_GT(largest_step(tracer), 10.0); // steps of the grid
  EXPECT_FALSE(motion.set_time(0.1, true, tracer).moved);
  EXPECT_EQ(largest_step(tracer), 0.0);
  EXPECT_FALSE(motion.set_time(0.1, true, tracer).moved);
  EXPECT_TRUE(motion.set_time(0.1 + kFrames / 24.0 + 0.02, true, tracer).moved); // the next round
  EXPECT_GT(largest_step(tracer), 0.0);
  EXPECT_TRUE(motion.set_time(1e9, false, tracer).moved); // the last frame stays
  EXPECT_FALSE(motion.set_time(2e9, false, tracer).moved);
}

TEST(MeshMotion, MotionVectorsPointToWhereTheSurfaceWas) {
  const test::Cloth cloth(30);
  const BakedScene moving(cloth_scene(cloth, 0.0), moving_config(cloth));
  MeshMotion motion(moving.file);
  PackedTracer tracer(moving.file, moving.source, motion.geometries());
  motion.set_time(2.0 / 24.0, false, tracer);
  motion.set_time(3.0 / 24.0, false, tracer);
  const PrimaryCamera camera(test::camera_at({0.5, 0.5, -2}, {0.5, 0.5, 0}), {64, 64});
  const DeformedPast past(tracer);
  PreviousFrame previous{camera};
  previous.surfaces = &past;
  GBuffer now;
  Progress progress;
  trace_primary(moving.source, tracer, camera, previous, now, progress);

  // Vertex by vertex, from the source's frames: the point's barycentrics in the current frame, used in the one before.
  const baked::DeformationRecord& record = deformation_records(moving.file.sections().deformation)[0];
  const DeformationPlayer player(moving.file, 0);
  const baked::GeometryRecord& geometry = moving.file.geometries()[record.geometry];
  const double step = PositionGrid{geometry.step_mantissa, geometry.step_exponent}.step();
  const auto corners_in = [&](uint32_t frame, uint32_t triangle, DVec3(&out)[3]) {
    const uint32_t c = moving.file.cluster_of_triangle(record.geometry, triangle);
    const ClusterView view = moving.file.cluster(record.geometry, c);
    std::vector<FrameVertex> vertices(view.vertex_count());
    player.decode(frame, c, vertices);
    const Triangle t = view.triangle(triangle - view.record().first_triangle);
    for (int k = 0; k < 3; ++k)
      for (size_t axis = 0; axis < 3; ++axis)
        out[k][static_cast<int>(axis)] = static_cast<double>(record.lo[axis] + vertices[t[k]][axis]) * step;
  };
  size_t moved = 0, still = 0;
  for (size_t i = 0; i < now.instance.size(); ++i) {
    if (now.instance[i] == kNoInstance) continue;
    const PlacedGeometry& placed = moving.source.instances()[now.instance[i]];
    if (placed.geometry != record.geometry) {
      EXPECT_EQ(now.motion_px[i], Vec2(0));
      ++still;
      continue;
    }
    const DAffine world_from_object(placed.world_from_object);
    DVec3 a[3], b[3];
    corners_in(3, now.triangle[i], a), corners_in(2, now.triangle[i], b);
    const DVec3 p = transform_point(inverse(world_from_object), DVec3(now.position[i])), e = a[1] - a[0],
                f = a[2] - a[0], n = glm::cross(e, f);
    const double u = glm::dot(glm::cross(p - a[0], f), n) / glm::dot(n, n),
                 v = glm::dot(glm::cross(e, p - a[0]), n) / glm::dot(n, n);
    const DVec3 before = transform_point(world_from_object, b[0] + (b[1] - b[0]) * u + (b[2] - b[0]) * v);
    const std::optional<ProjectedPoint> seen = camera.project(before);
    ASSERT_TRUE(seen);
    const glm::dvec2 centre(static_cast<double>(i % 64) + 0.5, static_cast<double>(i / 64) + 0.5);
    EXPECT_LT(glm::distance(glm::dvec2(now.motion_px[i]), centre - seen->pixel), 0.05);
    moved += glm::length(now.motion_px[i]) > 0.1f;
  }
  EXPECT_GT(moved, 100u);
  EXPECT_GT(still, 20u);
}

TEST(MeshMotion, FilesWithoutFramesHaveNone) {
  const test::Cloth cloth(4);
  const BakedScene still(cloth_scene(cloth, 0.0));
  MeshMotion motion(still.file);
  EXPECT_TRUE(motion.empty());
  PackedTracer tracer(still.file, still.source, motion.geometries());
  EXPECT_FALSE(motion.set_time(1.0, true, tracer).moved);
}

} // namespace
} // namespace packtrace
