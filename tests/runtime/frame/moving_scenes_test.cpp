#include <cmath>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "runtime/ao/moved_occluders.h"
#include "runtime/frame/frame_loop.h"
#include "runtime/frame/instance_levels.h"
#include "runtime/frame/still.h"
#include "tests/deforming_meshes.h"
#include "tests/runtime/trace/packed_scenes.h"

namespace packtrace {
namespace {

constexpr double kFps = 24.0;
constexpr uint32_t kFrames = 5;
const DVec3 kDrift(0.02, 0.01, 0.0); // of deforming spheres, per frame

/// A floor and rows of spheres at two levels of detail by distance, which deform: they drift.
class LevelBench {
public:
  explicit LevelBench(bool lod = false) {
    test::add_shape(scene_, test::quad(Vec3(-20, 0, -20), Vec3(0, 0, 60), Vec3(40, 0, 0)));
    test::add_shape(scene_, test::sphere(Vec3(-2, 1, 2), 1.0f, 30)); // gets levels of detail
    config_.level_chains.push_back({{}, {8.0, 16.0}});
    for (const uint32_t rings : {16u, 8u, 4u}) {
      config_.level_chains[0].objects.push_back(static_cast<uint32_t>(scene_.objects.size()));
      const uint32_t object = test::add_object(scene_, test::sphere(Vec3(0), 1.0f, rings));
      const uint32_t mesh = scene_.objects[object].shapes[0].mesh;
      std::vector<std::vector<Vec3>> frames;
      for (uint32_t frame = 0; frame < kFrames; ++frame) {
        frames.push_back(scene_.meshes[mesh].positions);
        for (Vec3& p : frames.back()) p += Vec3(kDrift * double(frame));
      }
      config_.sequences.push_back({mesh, std::make_shared<test::GivenFrames>(std::move(frames)), kFps, 0});
    }
    for (int i = 0; i < 6; ++i) {
      Instance& instance = scene_.instances.emplace_back();
      instance.world_from_object[3] = Vec3(1.5f * static_cast<float>(i % 2), 1.0f, 4.0f * static_cast<float>(i));
    }
    config_.precision_kind = PrecisionKind::kAbsolute, config_.precision = 1e-4;
    if (lod) config_.lod = LodUse::kAll;
    baked_ = std::make_unique<test::BakedScene>(scene_, config_);
    frame_.size = {96, 64};
    frame_.ao.radius = 1.0f;
  }

  FrameScene frame_scene() const {
    FrameScene scene{&baked_->source, &baked_->file, {}};
    scene.backend.backend = Backend::kPacked;
    scene.deforms = true;
    return scene;
  }
  static Camera camera(double z = -6.0) { return test::camera_at(DVec3(0.5, 2, z), DVec3(0.7, 0.8, z + 7), 50.0); }
  const BakedFile& file() const { return baked_->file; }

  Scene scene_;
  BakeConfig config_;
  std::unique_ptr<test::BakedScene> baked_;
  FrameConfig frame_;
};

TEST(InstanceLevels, TheFirstFrameHasTheRightOnesAndLaterOnesChangeByOne) {
  const LevelBench bench;
  InstanceLevels levels(bench.file());
  ASSERT_FALSE(levels.empty());
  using Levels = std::vector<uint8_t>;
  levels.choose(DVec3(0, 1, -0.5)); // distances 0.5, 4.7, 8.5, 12.6, 16.5, 20.6
  EXPECT_EQ(levels.levels(), Levels({0, 0, 1, 1, 2, 2}));
  EXPECT_EQ(levels.changes().size(), 4u);
  levels.choose(DVec3(0, 1, -0.5));
  EXPECT_TRUE(levels.changes().empty());
  levels.choose(DVec3(0, 1, -100));
  EXPECT_EQ(levels.levels(), Levels({1, 1, 2, 2, 2, 2}));
  levels.choose(DVec3(0, 1, -100));
  EXPECT_EQ(levels.levels(), Levels({2, 2, 2, 2, 2, 2}));
  EXPECT_EQ(levels.used()[bench.file().instances()[2].geometry], 0); // level 0, which nothing shows
  for (const int expected : {1, 0, 0}) {
    levels.choose(DVec3(0.5, 1, 8));
    EXPECT_EQ(levels.levels()[2], expected);
  }
  levels.reset();
  levels.choose(DVec3(0, 1, -100));
  EXPECT_EQ(levels.levels(), Levels({2, 2, 2, 2, 2, 2}));
}

TEST(InstanceLevels, FollowInstancesThatMove) {
  const LevelBench bench;
  InstanceLevels levels(bench.file());
  Affine far(1.0f);
  far[3] = Vec3(0, 1, 100);
  levels.move_instance(2, far);
  levels.move_instance(0, far); // the floor has no levels
  levels.choose(DVec3(0, 1, 0));
  EXPECT_EQ(levels.levels()[0], 2);
  EXPECT_EQ(levels.levels()[1], 0);
}

TEST(InstanceLevels, RefuseLevelsOfOtherScenes) {
  const LevelBench bench;
  InstanceLevels levels(bench.file());
  EXPECT_FALSE(levels.set_levels(std::vector<uint8_t>{0, 0, 0, 0, 0}));
  EXPECT_FALSE(levels.set_levels(std::vector<uint8_t>{0, 0, 0, 3, 0, 0}));
  EXPECT_TRUE(levels.set_levels(std::vector<uint8_t>{0, 1, 2, 2, 1, 0}));
  EXPECT_EQ(levels.levels()[3], 2);
}

/// Triangles of the level that an instance shows, from the largest triangle number in an image.
uint32_t largest_triangle(const GBuffer& g, uint32_t instance) {
  uint32_t largest = 0;
  for (size_t i = 0; i < g.instance.size(); ++i)
    if (g.instance[i] == instance) largest = std::max(largest, g.triangle[i]);
  return largest;
}

TEST(FrameLoop, ShowsTheLevelsOfTheDistance) {
  const LevelBench bench;
  FrameLoop loop(bench.frame_scene(), bench.frame_);
  Progress progress;
  loop.next_frame(LevelBench::camera(-3.0), 0.0, progress); // instance 2 is 3.2 away
  EXPECT_GT(largest_triangle(loop.gbuffer(), 2), 400u);     // of 16 * 32 * 2 - 64
  EXPECT_EQ(loop.next_frame(LevelBench::camera(-12.0), 0.0, progress).level_changes, 4u);
  EXPECT_LT(largest_triangle(loop.gbuffer(), 2), 240u); // of 8 * 16 * 2 - 32
  EXPECT_GT(largest_triangle(loop.gbuffer(), 2), 60u);
  EXPECT_TRUE(loop.next_frame(LevelBench::camera(-40.0), 0.0, progress).moved);
  EXPECT_LT(largest_triangle(loop.gbuffer(), 2), 56u); // of 4 * 8 * 2 - 16
  EXPECT_EQ(loop.next_frame(LevelBench::camera(-40.0), 0.0, progress).level_changes, 0u);
}

TEST(SceneState, NamesTheBoxesThatMoved) {
  const LevelBench bench;
  SceneState state(bench.frame_scene(), {});
  FrameReport report;
  const DVec3 eye(0.5, 2, -6);
  state.advance(eye, 0.0, report);
  EXPECT_TRUE(state.moved_boxes().empty()); // the first frame
  state.advance(eye, 0.0, report);
  EXPECT_TRUE(state.moved_boxes().empty());
  state.advance(eye, 1.0 / kFps, report);
  ASSERT_EQ(state.moved_boxes().size(), 6u); // spheres, but not the floor
  for (const MovedBox& box : state.moved_boxes()) {
    EXPECT_GE(box.instance, 2u);
    EXPECT_NEAR(glm::length(box.after.centre() - box.before.centre() - kDrift), 0.0, 3e-4);
    EXPECT_NEAR(double(box.moved), glm::length(kDrift) / std::sqrt(3.0), 1e-3); // of boxes of side 2
  }
  const std::vector<uint8_t> saved = state.save();
  SceneState resumed(bench.frame_scene(), {});
  ASSERT_TRUE(resumed.restore(1.0 / kFps, saved, report));
  for (SceneState* one : {&state, &resumed}) one->advance(eye, 2.0 / kFps, report);
  ASSERT_EQ(resumed.moved_boxes().size(), 6u);
  for (size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(resumed.moved_boxes()[i].before.lo, state.moved_boxes()[i].before.lo);
    EXPECT_EQ(resumed.moved_boxes()[i].after.hi, state.moved_boxes()[i].after.hi);
  }
}

/// Fraction of the pixels of drifting instances whose motion is wrong by more than 0.05 pixels.
double wrong_motion(const GBuffer& g, const Camera& camera, const Camera& before, ImageSize size, DVec3 moved) {
  const PrimaryCamera view(camera, size), previous(before, size);
  size_t wrong = 0, count = 0;
  for (size_t i = 0; i < g.instance.size(); ++i) {
    if (g.instance[i] == kNoInstance || g.instance[i] < 2) continue;
    const auto now = view.project(DVec3(g.position[i])), then = previous.project(DVec3(g.position[i]) - moved);
    if (!then) continue;
    wrong += glm::length(now->pixel - then->pixel - glm::dvec2(g.motion_px[i])) > 0.05;
    ++count;
  }
  EXPECT_GT(count, 100u);
  return double(wrong) / double(count);
}

TEST(FrameLoop, MotionVectorsHoldAcrossLevelChanges) {
  for (const bool lod : {false, true}) {
    const LevelBench bench(lod);
    FrameConfig config = bench.frame_;
    if (lod) config.detail.error_px = 1.0;
    FrameLoop loop(bench.frame_scene(), config);
    Progress progress;
    uint32_t changes = 0;
    loop.next_frame(LevelBench::camera(-6.0), 0.0, progress);
    for (const uint32_t frame : {1u, 2u, 3u, 4u}) {
      const Camera camera = LevelBench::camera(frame % 2 == 0 ? -6.0 : -12.0);
      const Camera before = LevelBench::camera(frame % 2 == 0 ? -12.0 : -6.0);
      changes += loop.next_frame(camera, frame / kFps, progress).level_changes;
      EXPECT_LT(wrong_motion(loop.gbuffer(), camera, before, config.size, kDrift), 1e-3) << frame << " " << lod;
    }
    EXPECT_GT(changes, 0u);
  }
}

TEST(FrameLoop, LevelsOfDetailGoWithDeformingMeshes) {
  const LevelBench bench(true);
  ASSERT_GT(bench.file().geometries().size(), bench.file().base_geometry_count());
  FrameConfig fine = bench.frame_, coarse = bench.frame_, occlusion = bench.frame_;
  fine.detail.error_px = 1e-6, coarse.detail.error_px = 2.0;
  occlusion.detail.error_px = 2.0, occlusion.detail.only_occlusion = true;
  FrameLoop plain(bench.frame_scene(), bench.frame_), same(bench.frame_scene(), fine),
      coarser(bench.frame_scene(), coarse), lifted(bench.frame_scene(), occlusion);
  Progress progress;
  for (const uint32_t frame : {0u, 1u, 3u}) {
    const Camera camera = LevelBench::camera(-6.0 - 2.0 * frame);
    for (FrameLoop* loop : {&plain, &same, &coarser, &lifted}) loop->next_frame(camera, frame / kFps, progress);
    size_t different = 0;
    for (size_t i = 0; i < plain.gbuffer().instance.size(); ++i) {
      const auto near = [&](FrameLoop& other) {
        return other.gbuffer().instance[i] == plain.gbuffer().instance[i] &&
               std::abs(other.gbuffer().view_z[i] - plain.gbuffer().view_z[i]) < 1e-3f;
      };
      if (plain.gbuffer().instance[i] >= 2) different += !near(coarser);
      different += !near(same) + !near(lifted);
    }
    EXPECT_LE(different, 10u) << frame;
    EXPECT_GT(largest_triangle(plain.gbuffer(), 1), 1.5 * largest_triangle(coarser.gbuffer(), 1));
  }
}

TEST(FrameLoop, LevelChangesContinueFromASavedState) {
  const LevelBench bench;
  const auto camera = [](uint32_t frame) { return LevelBench::camera(frame == 0 ? -4.0 : -40.0); };
  Progress progress;
  FrameLoop whole(bench.frame_scene(), bench.frame_), first(bench.frame_scene(), bench.frame_),
      second(bench.frame_scene(), bench.frame_);
  for (uint32_t frame = 0; frame < 4; ++frame) whole.next_frame(camera(frame), frame / kFps, progress);
  for (uint32_t frame = 0; frame < 2; ++frame) first.next_frame(camera(frame), frame / kFps, progress);
  const std::vector<std::byte> saved = first.save();
  second.restore(camera(1), 1 / kFps, saved);
  for (uint32_t frame = 2; frame < 4; ++frame) second.next_frame(camera(frame), frame / kFps, progress);
  RenderedImage a, b;
  PictureReport report;
  whole.resolve(a, report), second.resolve(b, report);
  EXPECT_EQ(a.ao, b.ao);
  EXPECT_EQ(a.depth, b.depth);
  EXPECT_EQ(whole.gbuffer().triangle, second.gbuffer().triangle);
  EXPECT_EQ(whole.gbuffer().motion_px, second.gbuffer().motion_px);
  std::vector<std::byte> damaged = saved;
  damaged[sizeof(uint64_t) + sizeof(uint32_t)] = std::byte{5}; // number of levels
  EXPECT_THROW(second.restore(camera(1), 1 / kFps, damaged), Error);
}

} // namespace
} // namespace packtrace
