#include "runtime/trace/packed/scene/mesh_motion.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

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
