#include <gtest/gtest.h>

#include "pbrt_import/scene/motion_pose.h"
#include "tests/runtime/motion/moving_scenes.h"

namespace packtrace {
namespace {

double largest_difference(const DAffine& a, const DAffine& b) {
  double largest = 0.0;
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 3; ++row) largest = std::max(largest, std::abs(a[column][row] - b[column][row]));
  return largest;
}

Bounds box_of_size(double size) {
  Bounds box;
  box.lo = DVec3(-size, -0.5 * size, 0.0), box.hi = DVec3(size, size, 2.0 * size);
  return box;
}

TEST(MotionPose, LinearTracksFollowTheInterpolationOfTheImport) {
  const Scene scene = test::separate_carts();
  ASSERT_FALSE(scene.animations.empty());
  const InstanceMotion& cube = scene.motion.instances.front();
  const AnimatedTransform& keys = scene.animations[scene.shapes[cube.instance].animation];
  for (int i = -2; i <= 22; ++i) {
    const double time = 0.1 * i;
    EXPECT_LT(largest_difference(pose(scene.motion.tracks[cube.track], time), interpolate(keys, time)), 1e-12) << time;
  }
}

TEST(MotionPose, CatmullRomPassesThroughItsKeysAndIsSmoothThere) {
  const MotionTrack track = test::random_track(7, 6, KeyInterpolation::kCatmullRom);
  for (const MotionKey& key : track.keys) {
    const glm::dmat3 linear = glm::mat3_cast(key.rotation) * key.scale;
    const DAffine expected(linear[0], linear[1], linear[2], key.translation);
    EXPECT_LT(largest_difference(pose(track, key.time_s), expected), 1e-12 * 1000);
  }
  const double h = 1e-8, time = track.keys[2].time_s;
  const DVec3 before = (pose(track, time)[3] - pose(track, time - h)[3]) / h;
  const DVec3 after = (pose(track, time + h)[3] - pose(track, time)[3]) / h;
  EXPECT_LT(glm::distance(before, after), 1e-2);
  EXPECT_GT(glm::length(after), 1.0);
}

TEST(MotionPose, CatmullRomOfEvenKeysOnALineIsEven) {
  MotionTrack track;
  track.interpolation = KeyInterpolation::kCatmullRom;
  for (int i = 0; i < 4; ++i) track.keys.push_back({1.0 * i, DVec3(2.0 * i, 0, 0), {1, 0, 0, 0}, glm::dmat3(1.0)});
  for (double time = 0.0; time <= 3.0; time += 0.125) EXPECT_NEAR(pose(track, time)[3].x, 2.0 * time, 1e-12);
}

TEST(MotionPose, LoopsRepeat) {
  MotionTrack track = test::random_track(3, 4, KeyInterpolation::kLinear);
  track.loop = true;
  const double period = track.keys.back().time_s - track.keys.front().time_s, begin = track.keys.front().time_s;
  for (const double part : {0.1, 0.5, 0.9})
    for (const int turn : {-3, 1, 10})
      EXPECT_LT(largest_difference(pose(track, begin + part * period), pose(track, begin + (part + turn) * period)),
                1e-9);
}

TEST(MotionPose, AHalfTurnKeepsItsWay) {
  MotionTrack track;
  track.keys = {{0.0, DVec3(0), {1, 0, 0, 0}, glm::dmat3(1.0)}, {1.0, DVec3(0), {-1e-9, 0, 1, 0}, glm::dmat3(1.0)}};
  const DAffine middle = pose(track, 0.5);
  EXPECT_NEAR(middle[0].z, -1.0, 1e-6); // a quarter turn about y takes x to -z
}

TEST(MotionPose, SweptBoundsContainSampledPoses) {
  for (uint32_t seed = 0; seed < 40; ++seed) {
    RigidMotion motion;
    const auto interpolation = seed % 2 == 0 ? KeyInterpolation::kLinear : KeyInterpolation::kCatmullRom;
    motion.tracks = {test::random_track(seed, 2 + seed % 5, interpolation),
                     test::random_track(seed + 100, 3, KeyInterpolation::kLinear)};
    motion.tracks[0].loop = seed % 3 == 0;
    InstanceMotion moving;
    if (seed % 4 == 1) moving.inner_track = 1;
    if (seed % 4 == 2) moving.relative = true, moving.pivot = Vec3(3, 4, 5);
    const Affine placement(Vec3(0, 2, 0), Vec3(-1, 0, 0), Vec3(0, 0, -1), Vec3(10, 20, 30));
    const Bounds box = box_of_size(1.0 + seed), swept = swept_bounds(motion, moving, placement, box);
    for (double time = -10.0; time < 12.0; time += 0.0173) {
      const Bounds now = transform_bounds(pose(motion, moving, placement, time), box);
      for (int axis = 0; axis < 3; ++axis)
        ASSERT_TRUE(now.lo[axis] >= swept.lo[axis] && now.hi[axis] <= swept.hi[axis]) << seed << " at " << time;
    }
  }
}

TEST(MotionPose, SweptBoundsOfAMoveAreTight) {
  RigidMotion motion;
  motion.tracks.resize(1);
  motion.tracks[0].keys = {{0.0, DVec3(0), {1, 0, 0, 0}, glm::dmat3(1.0)},
                           {1.0, DVec3(10, 0, 0), {1, 0, 0, 0}, glm::dmat3(1.0)}};
  const Bounds swept = swept_bounds(motion, {}, Affine(1.0f), box_of_size(1.0));
  EXPECT_NEAR(swept.lo.x, -1.0, 1e-5);
  EXPECT_NEAR(swept.hi.x, 11.0, 1e-5);
  EXPECT_NEAR(swept.hi.y, 1.0, 1e-5);
}

TEST(MotionPose, StretchIsBounded) {
  for (uint32_t seed = 0; seed < 10; ++seed) {
    RigidMotion motion;
    motion.tracks = {
        test::random_track(seed, 4, seed % 2 == 0 ? KeyInterpolation::kLinear : KeyInterpolation::kCatmullRom)};
    const double bound = largest_stretch(motion, {}, Affine(1.0f));
    for (double time = -5.0; time < 10.0; time += 0.01) {
      const DAffine map = pose(motion.tracks[0], time);
      for (int row = 0; row < 3; ++row)
        ASSERT_LE(std::abs(map[0][row]) + std::abs(map[1][row]) + std::abs(map[2][row]), bound * (1 + 1e-12));
    }
  }
}

TEST(SeparateMotion, ShapesOfObjectsBecomeInstances) {
  const Scene before = test::carts(), scene = test::separate_carts();
  EXPECT_EQ(before.shapes.size(), scene.shapes.size());
  EXPECT_EQ(before.instances.size(), 3u);
  ASSERT_EQ(scene.instances.size(), 6u); // each cart and its wheel
  EXPECT_EQ(scene.objects.size(), before.objects.size() + 1);
  EXPECT_EQ(scene.objects.back().shapes.size(), 1u);
  ASSERT_EQ(scene.motion.instances.size(), 5u); // the cube, a cart, three wheels
  EXPECT_EQ(scene.motion.cameras.size(), 1u);
  EXPECT_EQ(placed_triangle_count(before), placed_triangle_count(scene));
  // At the scene's time everything stands as before.
  for (const InstanceMotion& moving : scene.motion.instances) {
    const bool shape = moving.instance < scene.shapes.size();
    const DAffine rest = shape ? scene.shapes[moving.instance].parent_from_mesh
                               : DAffine(scene.instances[moving.instance - scene.shapes.size()].world_from_object);
    EXPECT_LT(largest_difference(pose(scene.motion, moving, Affine(1.0f), scene.time), rest), 1e-6);
  }
}

TEST(SeparateMotion, WithoutAnimationsNothingChanges) {
  Scene scene = test::mixed_scene();
  const size_t instances = scene.instances.size();
  separate_motion(scene);
  EXPECT_TRUE(scene.motion.empty());
  EXPECT_EQ(scene.instances.size(), instances);
}

TEST(SeparateMotion, NestedMotionIsTheProductOfBoth) {
  const Scene before = test::carts(), scene = test::separate_carts();
  ASSERT_EQ(before.animated_instances.size(), 1u);
  const AnimatedTransform& cart = before.animations[before.animated_instances[0].animation];
  const Shape& wheel = before.objects.front().shapes.back();
  ASSERT_NE(wheel.animation, kNotAnimated);
  const auto chained = std::find_if(scene.motion.instances.begin(), scene.motion.instances.end(), [&](const auto& one) {
    return one.inner_track != kNoTrack && scene.motion.tracks[one.track].keys.size() == 2;
  });
  ASSERT_NE(chained, scene.motion.instances.end());
  for (double time = 0.0; time <= 2.0; time += 0.1) {
    const DAffine expected = compose(interpolate(cart, time), interpolate(before.animations[wheel.animation], time));
    EXPECT_LT(largest_difference(pose(scene.motion, *chained, Affine(1.0f), time), expected), 1e-12);
  }
}

} // namespace
} // namespace packtrace
