#include <gtest/gtest.h>

#include "compress/bake/write/motion_packer.h"
#include "compress/format/motion/motion_stream.h"
#include "pbrt_import/scene/motion_pose.h"
#include "tests/compress/file_damage.h"
#include "tests/runtime/motion/moving_scenes.h"

namespace packtrace {
namespace {

std::vector<DVec3> corners(const Bounds& box) {
  std::vector<DVec3> result;
  for (int i = 0; i < 8; ++i)
    result.emplace_back(i & 1 ? box.hi.x : box.lo.x, i & 2 ? box.hi.y : box.lo.y, i & 4 ? box.hi.z : box.lo.z);
  return result;
}

MovingBox random_box(test::Random& random) {
  MovingBox box;
  box.box.lo = -DVec3(random.uniform(0.1f, 2), random.uniform(0.1f, 2), random.uniform(0.1f, 2));
  box.box.hi = DVec3(random.uniform(0.1f, 2), random.uniform(0.1f, 2), random.uniform(0.1f, 2));
  box.placement = Affine(Vec3(0, 2, 0), Vec3(-2, 0, 0), Vec3(0, 0, 2), Vec3(random.uniform(-100, 100), 20, 30));
  box.position_error = 1e-3 * random.uniform(0.01f, 1);
  return box;
}

/// Instances with random tracks: alone, chained and relative, of both interpolations.
struct RandomMotion {
  RigidMotion motion;
  std::vector<MovingBox> boxes;

  explicit RandomMotion(uint32_t seed) {
    test::Random random(seed);
    for (uint32_t i = 0; i < 6; ++i) {
      motion.tracks.push_back(test::random_track(
          10 * seed + i, 2 + (seed + i) % 5, i % 2 == 0 ? KeyInterpolation::kLinear : KeyInterpolation::kCatmullRom));
      motion.tracks.back().loop = i == 3;
      InstanceMotion moving;
      moving.instance = 3 * i + seed % 2, moving.track = i;
      if (i == 2) moving.inner_track = 1;
      if (i >= 4) moving.relative = true, moving.pivot = Vec3(random.uniform(-3, 3), 1, 2);
      motion.instances.push_back(moving);
      boxes.push_back(random_box(random));
    }
    motion.cameras.push_back({1, 5});
  }

  PackedMotion packed() const {
    Progress progress;
    return pack_motion(motion, boxes, progress);
  }
};

TEST(MotionFile, StatedErrorsHoldAtAllTimesAndAreSmall) {
  for (uint32_t seed = 1; seed <= 12; ++seed) {
    const RandomMotion random(seed);
    const PackedMotion packed = random.packed();
    ASSERT_EQ(packed.motion.instances.size(), random.motion.instances.size());
    test::Random times(seed);
    for (size_t i = 0; i < random.boxes.size(); ++i) {
      const InstanceMotion &source = random.motion.instances[i], &decoded = packed.motion.instances[i];
      double largest = 0.0;
      const auto measure = [&](double time) {
        const DAffine exact = pose(random.motion, source, random.boxes[i].placement, time);
        const DAffine rounded = pose(packed.motion, decoded, random.boxes[i].placement, time);
        for (const DVec3 corner : corners(random.boxes[i].box))
          largest = std::max(largest, glm::distance(transform_point(exact, corner), transform_point(rounded, corner)));
      };
      for (int k = 0; k < 2000; ++k) measure(double{times.uniform(-8, 16)});
      for (const MotionTrack& track : random.motion.tracks)
        for (const MotionKey& key : track.keys) measure(key.time_s);
      EXPECT_LE(largest, decoded.error_world) << seed << " " << i;
      EXPECT_GT(largest, 0.1 * decoded.error_world); // stated errors are no mere guesses
      // The placement stretches lengths by 2 along each axis.
      EXPECT_LE(decoded.error_world, 1.26 * kMotionErrorFraction * 2.0 * random.boxes[i].position_error);
    }
  }
}

TEST(MotionFile, TimesAndStructureAreExact) {
  const RandomMotion random(4);
  const PackedMotion packed = random.packed();
  for (size_t i = 0; i < random.motion.instances.size(); ++i) {
    const InstanceMotion &source = random.motion.instances[i], &decoded = packed.motion.instances[i];
    EXPECT_EQ(source.instance, decoded.instance);
    EXPECT_EQ(source.relative, decoded.relative);
    EXPECT_EQ(source.pivot, decoded.pivot);
    EXPECT_EQ(source.inner_track == kNoTrack, decoded.inner_track == kNoTrack);
    const MotionTrack &a = random.motion.tracks[source.track], &b = packed.motion.tracks[decoded.track];
    EXPECT_EQ(a.interpolation, b.interpolation);
    EXPECT_EQ(a.loop, b.loop);
    ASSERT_EQ(a.keys.size(), b.keys.size());
    for (size_t k = 0; k < a.keys.size(); ++k) EXPECT_EQ(a.keys[k].time_s, b.keys[k].time_s);
  }
  EXPECT_EQ(packed.motion.cameras.front().camera, 1u);
}

TEST(MotionFile, EqualTracksAreStoredOnce) {
  RandomMotion random(2);
  for (size_t i = 1; i < 6; ++i) random.motion.tracks[i] = random.motion.tracks[0];
  const PackedMotion packed = random.packed();
  EXPECT_EQ(packed.motion.tracks.size(), 1u);
}

TEST(MotionFile, TruncatedStreamsAreRefused) {
  const PackedMotion packed = RandomMotion(5).packed();
  RigidMotion motion;
  for (size_t size = 1; size < packed.bytes.size(); ++size)
    EXPECT_TRUE(unpack_rigid_motion(std::span(packed.bytes).first(size), motion)) << size;
  std::vector<uint8_t> longer = packed.bytes;
  longer.push_back(0);
  EXPECT_TRUE(unpack_rigid_motion(longer, motion));
}

TEST(MotionFile, ChangedBitsAreRefusedOrHarmless) {
  const BakedScene baked = test::bake(test::separate_carts());
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  const size_t size = file.sections().rigid_motion.size();
  ASSERT_GT(size, 100u);
  const auto offset =
      static_cast<size_t>(file.sections().rigid_motion.data() - reinterpret_cast<const uint8_t*>(file.bytes().data()));
  size_t refused = 0;
  for (size_t bit = 0; bit < 8 * size; ++bit) {
    std::vector<std::byte> damaged = baked.bytes;
    damaged[offset + bit / 8] ^= std::byte{1} << (bit % 8);
    test::rehash<baked::FileHeader>(damaged);
    try {
      const BakedFile changed = BakedFile::from_bytes(damaged);
      RigidMotion motion;
      ASSERT_FALSE(unpack_rigid_motion(changed.sections().rigid_motion, motion));
      for (const InstanceMotion& moving : motion.instances) {
        const Affine map(pose(motion, moving, changed.world_from_object(moving.instance), 0.7));
        for (int column = 0; column < 4; ++column) ASSERT_TRUE(is_finite(map[column])) << bit;
      }
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kInput);
      ++refused;
    }
  }
  EXPECT_GT(refused, size);
}

TEST(MotionFile, DeclaredKeysNeedBytes) {
  // One track of 2^31 keys, one instance: refused before anything is allocated.
  const std::vector<uint8_t> bytes{1, 1, 0, 0, 0x80, 0x80, 0x80, 0x80, 8, 0, 0, 0, 0, 0, 0, 0, 0};
  RigidMotion motion;
  const auto fault = unpack_rigid_motion(bytes, motion);
  ASSERT_TRUE(fault);
  EXPECT_STREQ(fault->what, "number of keys");
}

TEST(BakeMotion, MovingThingsHaveGeometryOfTheirOwn) {
  const Scene scene = test::separate_carts();
  const BakedFile file = BakedFile::from_bytes(test::bake(scene).bytes);
  ASSERT_EQ(file.instances().size(), scene.shapes.size() + scene.instances.size());
  for (const InstanceMotion& moving : scene.motion.instances)
    EXPECT_EQ(file.geometries()[file.instances()[moving.instance].geometry].flags & baked::kWorldSpace, 0u);
  const FileSummary summary = summarize(file);
  EXPECT_EQ(summary.motion.instances, 5u);
  EXPECT_EQ(summary.motion.cameras, 1u);
  EXPECT_EQ(summary.motion.time.begin_s, 0.0);
  EXPECT_EQ(summary.motion.time.end_s, 2.0);
  EXPECT_GT(summary.bytes.rigid_motion, 0u);
}

TEST(BakeMotion, WithoutSeparationTheSceneStands) {
  Scene still = test::carts();
  const BakedScene animated = test::bake(still);
  EXPECT_EQ(BakedFile::from_bytes(animated.bytes).sections().rigid_motion.size(), 0u);
}

TEST(BakeMotion, AllCodecsHoldTheSameMotion) {
  const Scene scene = test::separate_carts();
  const BakedScene plain = test::bake(scene);
  for (const PageCodec codec : {PageCodec::kFast, PageCodec::kSmall}) {
    BakeConfig config;
    config.codec = codec;
    EXPECT_TRUE(std::ranges::equal(BakedFile::from_bytes(test::bake(scene, config).bytes).bytes(), plain.bytes));
  }
}

TEST(BakeMotion, MotionOfWorldSpaceGeometryIsRefused) {
  const Scene scene = test::separate_carts();
  const BakedScene baked = test::bake(scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  RigidMotion motion;
  ASSERT_FALSE(unpack_rigid_motion(file.sections().rigid_motion, motion));
  ASSERT_EQ(motion.instances.front().instance, 1u); // the floor is before the cube
  std::vector<std::byte> damaged = baked.bytes;
  baked::GeometryRecord* const geometries = reinterpret_cast<baked::GeometryRecord*>(
      damaged.data() + (reinterpret_cast<const std::byte*>(file.geometries().data()) - file.bytes().data()));
  geometries[file.instances()[1].geometry].flags |= baked::kWorldSpace;
  test::rehash<baked::FileHeader>(damaged);
  std::string message;
  EXPECT_EQ(test::open_kind(damaged, &message), ErrorKind::kInput);
}

} // namespace
} // namespace packtrace
