#include <gtest/gtest.h>

#include <tbb/global_control.h>

#include "compress/format/motion/motion_stream.h"
#include "runtime/motion/scene_motion.h"
#include "runtime/trace/source/float_source.h"
#include "runtime/trace/source/packed_source.h"
#include "tests/runtime/motion/moving_scenes.h"

namespace packtrace {
namespace {

TEST(SceneMotion, SceneAndFileAgree) {
  const Scene scene = test::separate_carts();
  const BakedFile file = BakedFile::from_bytes(test::bake(scene).bytes);
  const SceneMotion floats = SceneMotion::of(scene), packed = SceneMotion::of(file);
  ASSERT_TRUE(std::ranges::equal(floats.moving_instances(), packed.moving_instances()));
  EXPECT_EQ(floats.begin_s(), packed.begin_s());
  EXPECT_EQ(floats.end_s(), packed.end_s());
  EXPECT_EQ(FloatSource(scene).instances().size(), PackedSource(file).instances().size());
  for (size_t i = 0; i < packed.moving_instances().size(); ++i) {
    const Bounds box = object_bounds(file.geometries()[file.instances()[packed.moving_instances()[i]].geometry]);
    ASSERT_GT(packed.error_world(i), 0.0);
    for (double time = -0.5; time < 2.5; time += 0.03)
      for (const DVec3 corner : {box.lo, box.hi})
        EXPECT_LE(
            glm::distance(transform_point(floats.pose(i, time), corner), transform_point(packed.pose(i, time), corner)),
            packed.error_world(i));
  }
}

TEST(SceneMotion, SourcesPlaceMovingThingsAsAtTheTimeOfTheScene) {
  const Scene scene = test::separate_carts();
  const SceneMotion motion = SceneMotion::of(scene);
  const FloatSource source(scene);
  for (size_t i = 0; i < motion.moving_instances().size(); ++i) {
    const DAffine rest(source.instances()[motion.moving_instances()[i]].world_from_object);
    const DAffine pose = motion.pose(i, scene.time);
    for (int column = 0; column < 4; ++column) EXPECT_LT(glm::distance(rest[column], pose[column]), 1e-6);
  }
}

TEST(SceneMotion, WorldBoundsHoldForTheWholeMotion) {
  const Scene scene = test::separate_carts();
  const BakedFile file = BakedFile::from_bytes(test::bake(scene).bytes);
  const PackedSource source(file);
  const SceneMotion motion = SceneMotion::of(file);
  const Bounds world = source.world_bounds();
  std::vector<Affine> poses(motion.moving_instances().size());
  for (double time = -0.5; time < 2.5; time += 0.01) {
    motion.pose(time, poses);
    for (size_t i = 0; i < poses.size(); ++i) {
      const uint32_t geometry = file.instances()[motion.moving_instances()[i]].geometry;
      const Bounds now = transform_bounds(DAffine(poses[i]), object_bounds(file.geometries()[geometry]));
      for (int axis = 0; axis < 3; ++axis)
        ASSERT_TRUE(now.lo[axis] >= world.lo[axis] && now.hi[axis] <= world.hi[axis]);
    }
  }
  EXPECT_GT(world.hi.y, 2.5); // the cube's corners above the floor
}

TEST(SceneMotion, PosesDoNotDependOnThreads) {
  const SceneMotion motion = SceneMotion::of(test::separate_carts());
  std::vector<Affine> one(motion.moving_instances().size()), many(one.size());
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    motion.pose(0.37, one);
  }
  motion.pose(0.37, many);
  EXPECT_EQ(one, many);
  for (size_t i = 0; i < one.size(); ++i) EXPECT_EQ(one[i], Affine(motion.pose(i, 0.37)));
}

TEST(SceneMotion, CamerasMove) {
  const SceneMotion motion = SceneMotion::of(test::separate_carts());
  ASSERT_TRUE(motion.camera_moves(0));
  EXPECT_FALSE(motion.camera(1, 0.0));
  const DVec3 begin = motion.camera(0, 0.0)->world_from_camera[3], end = motion.camera(0, 2.0)->world_from_camera[3];
  EXPECT_NEAR(glm::distance(begin, end), 0.5, 1e-9);
}

TEST(SceneMotion, NothingMovesInAStillScene) {
  const SceneMotion motion = SceneMotion::of(test::mixed_scene());
  EXPECT_FALSE(motion.moves());
  EXPECT_EQ(motion.moving_instances().size(), 0u);
  EXPECT_EQ(motion.end_s(), 0.0);
  EXPECT_TRUE(motion.moving_bounds().empty());
}

} // namespace
} // namespace packtrace
