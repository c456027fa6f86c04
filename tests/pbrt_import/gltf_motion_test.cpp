// Animations of glTF files as tracks of moving instances and cameras, and as frames of deforming meshes.

#include <algorithm>
#include <cmath>
#include <limits>

#include "pbrt_import/base/error.h"
#include "pbrt_import/scene/motion_pose.h"
#include "tests/pbrt_import/gltf_documents.h"

namespace packtrace {
namespace {

using Json = nlohmann::json;

constexpr float kHalf = 0.70710678f;
const std::vector<float> kTurns = {0, 0, 0, 1, 0, kHalf, 0, kHalf, kHalf, 0, 0, kHalf};
/// In-tangent, value, out-tangent of three keys.
const std::vector<float> kCurve = {9, 9, 9, 0, 0, 0, 0, 16, 0, 0, -8, 0, 0, 4, 0, 3, 0, 0, 1, 1, 1, 2, 1, 0, 9, 9, 9};

Imported import_time(const SceneFolder& folder, const GltfBuilder& gltf, double time, ImportOptions options = {}) {
  options.time = time;
  return import_file(folder.write("a.gltf", gltf.text()), options);
}

/// Largest distance, at times of the animation, between where the motion has corners of a box and where an import at
/// the time has them.
double largest_difference(const SceneFolder& folder, const GltfBuilder& gltf, double begin, double end,
                          const ImportOptions& options = {}) {
  const Imported moving = import_time(folder, gltf, begin, options);
  EXPECT_EQ(moving.scene.motion.instances.size(), 1u) << moving.text();
  if (moving.scene.motion.instances.empty()) return std::numeric_limits<double>::infinity();
  const InstanceMotion& motion = moving.scene.motion.instances[0];
  double largest = 0.0;
  constexpr int kTimes = 37;
  for (int i = 0; i < kTimes; ++i) {
    const double time = begin + (end - begin) * i / kTimes;
    const Imported there = import_time(folder, gltf, time, options);
    const DAffine wanted(there.scene.instances.at(0).world_from_object);
    const DAffine map = pose(moving.scene.motion, motion, moving.scene.instances[0].world_from_object, time);
    for (const DVec3 corner : {DVec3(0.0), DVec3(-1, 1, 1), DVec3(1, -1, 1)})
      largest = std::max(largest, glm::distance(transform_point(wanted, corner), transform_point(map, corner)));
  }
  return largest;
}

TEST(GltfMotion, TracksEqualTheAnimationWhereTheyCan) {
  const std::vector<std::vector<GltfChannel>> cases = {
      {{0, "translation", "LINEAR", {0, 1, 4}, {0, 0, 0, 3, 1, 0, 0, 5, 2}}},
      {{0, "rotation", "LINEAR", {0, 1, 4}, kTurns}},
      {{0, "scale", "LINEAR", {1, 3}, {1, 1, 1, 2, 0.5f, -1}}},
      {{0, "rotation", "STEP", {0, 1, 4}, kTurns}},
      {{0, "translation", "LINEAR", {0, 2}, {0, 0, 0, 3, 1, 0}}, // with keys at different times
       {0, "rotation", "LINEAR", {1, 3, 4}, kTurns},
       {0, "scale", "STEP", {0, 2.5f}, {1, 1, 1, 2, 3, 4}}}};
  const SceneFolder folder;
  for (size_t i = 0; i < cases.size(); ++i) {
    GltfBuilder gltf = gltf_triangle({{"translation", {1, 2, 3}}});
    // Below a node that turns and scales uniformly, in a file whose z points upwards.
    gltf.json["scenes"][0]["nodes"] = Json::array();
    gltf.node(
        {{"children", {0}}, {"rotation", {kHalf, 0, 0, kHalf}}, {"scale", {2, 2, 2}}, {"translation", {5, 0, 0}}});
    add_animation(gltf, cases[i]);
    ImportOptions options;
    options.mesh_up = UpAxis::kZ, options.mesh_scale = 0.5;
    double begin = 4.0, end = 0.0; // outside the animation repeats, while an import holds the last key
    for (const GltfChannel& channel : cases[i])
      begin = std::min(begin, double{channel.times.front()}), end = std::max(end, double{channel.times.back()});
    EXPECT_LT(largest_difference(folder, gltf, begin, end, options), 2e-6) << i;
    size_t keys = 2; // at the ends of the animation
    for (const GltfChannel& channel : cases[i])
      keys += channel.times.size() * (channel.interpolation == "STEP" ? 2 : 1);
    EXPECT_LE(import_time(folder, gltf, 0.0).scene.motion.tracks.at(0).keys.size(), keys) << i;
  }
}

TEST(GltfMotion, OtherAnimationsGetKeysUntilTheyAreClose) {
  const SceneFolder folder;
  GltfBuilder curve = gltf_triangle();
  add_animation(curve, {{0, "translation", "CUBICSPLINE", {0, 1, 4}, kCurve}});
  // A moving node below another, and one below a parent that scales unevenly.
  GltfBuilder nested = gltf_triangle({{"translation", {0, 3, 0}}});
  nested.json["scenes"][0]["nodes"] = Json::array();
  nested.node({{"children", {0}}});
  add_animation(nested, {{0, "rotation", "LINEAR", {0, 1, 4}, kTurns}, {1, "rotation", "LINEAR", {0, 2, 3}, kTurns}});
  GltfBuilder sheared = gltf_triangle();
  sheared.json["scenes"][0]["nodes"] = Json::array();
  sheared.node({{"children", {0}}, {"scale", {1, 2, 1}}});
  add_animation(sheared, {{0, "rotation", "LINEAR", {0, 1, 4}, kTurns}});
  const std::vector<std::pair<const GltfBuilder*, double>> cases = {{&curve, 12.0}, {&nested, 6.0}, {&sheared, 3.0}};
  for (size_t i = 0; i < cases.size(); ++i) {
    const auto& [gltf, size] = cases[i];
    EXPECT_LT(largest_difference(folder, *gltf, 0.0, 4.0), 0x1p-11 * size) << i; // tolerance of a turn and of a shift
    const size_t keys = import_time(folder, *gltf, 0.0).scene.motion.tracks.at(0).keys.size();
    EXPECT_GT(keys, 8u) << i;
    EXPECT_LT(keys, 400u) << i;
  }
}

TEST(GltfMotion, StepsJumpAndTheAnimationRepeats) {
  const SceneFolder folder;
  GltfBuilder gltf = gltf_triangle();
  add_animation(gltf, {{0, "translation", "STEP", {1, 2}, {0, 1, 0, 0, 7, 0}},
                       {0, "scale", "LINEAR", {1, 5}, {1, 1, 1, 2, 2, 2}}});
  const Imported imported = import_time(folder, gltf, 0.0);
  EXPECT_TRUE(imported.reported("the animation makes 1 track from 1 to 5 s, which repeat")) << imported.text();
  EXPECT_EQ(imported.statistics.animated_instances, 1u);
  const MotionTrack& track = imported.scene.motion.tracks.at(0);
  EXPECT_EQ(pose(track, std::nextafter(2.0, 0.0))[3].y, 1.0);
  EXPECT_EQ(pose(track, 2.0)[3].y, 7.0);
  EXPECT_EQ(pose(track, 4.0)[3].y, 7.0);
  for (const double time : {1.0, 1.5, 2.0, 4.5}) EXPECT_EQ(pose(track, time + 4.0), pose(track, time)) << time;
  EXPECT_EQ(pose(track, 0.0), pose(track, 4.0));
}

TEST(GltfMotion, WhatHangsOnAMovingNodeSharesItsTrack) {
  const SceneFolder folder;
  GltfBuilder gltf = gltf_triangle({{"children", {1, 2}}});
  for (const float x : {2.0f, 4.0f}) gltf.json["nodes"].push_back({{"mesh", 0}, {"translation", {x, 0, 0}}});
  add_animation(gltf, {{0, "rotation", "LINEAR", {0, 1, 4}, kTurns}});
  const Imported imported = import_time(folder, gltf, 0.5);
  EXPECT_EQ(imported.scene.motion.tracks.size(), 3u); // two are constant
  ASSERT_EQ(imported.scene.instances.size(), 3u);
  ASSERT_EQ(imported.scene.motion.instances.size(), 3u);
  for (size_t i = 0; i < 3; ++i) {
    const DAffine map = pose(imported.scene.motion, imported.scene.motion.instances[i], Affine(1.0f), 0.5);
    const DAffine wanted(imported.scene.instances[i].world_from_object);
    for (int column = 0; column < 4; ++column) EXPECT_LT(glm::distance(map[column], wanted[column]), 1e-6) << i;
  }
}

TEST(GltfMotion, CamerasMove) {
  const SceneFolder folder;
  GltfBuilder gltf = gltf_triangle();
  gltf.json["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 1.0}}}}};
  gltf.node({{"camera", 0}});
  add_animation(
      gltf, {{1, "rotation", "LINEAR", {0, 1, 4}, kTurns}, {1, "translation", "LINEAR", {0, 4}, {0, 0, 9, 3, 0, 9}}});
  const Imported imported = import_time(folder, gltf, 0.0);
  EXPECT_EQ(imported.statistics.animated_cameras, 1u);
  ASSERT_EQ(imported.scene.motion.cameras.size(), 1u);
  EXPECT_TRUE(imported.scene.motion.instances.empty());
  for (const double time : {0.0, 0.5, 1.0, 3.3}) {
    const DAffine map = pose(imported.scene.motion.tracks.at(imported.scene.motion.cameras[0].track), time);
    const DAffine wanted = import_time(folder, gltf, time).scene.cameras.at(0).world_from_camera;
    for (int column = 0; column < 4; ++column) EXPECT_LT(glm::distance(map[column], wanted[column]), 1e-7) << time;
  }
}

TEST(GltfMotion, AnAnimationIsChosenByNameOrNumber) {
  const SceneFolder folder;
  GltfBuilder gltf = gltf_triangle();
  add_animation(gltf, {{0, "translation", "LINEAR", {0, 1}, {0, 0, 0, 0, 5, 0}}}, "walk");
  add_animation(gltf, {{0, "translation", "LINEAR", {0, 2}, {0, 0, 0, 0, 8, 0}}}, "run");
  const auto height = [&](std::optional<std::string> name) {
    ImportOptions options;
    options.animation = std::move(name);
    return import_time(folder, gltf, 1.0, options).scene.instances.at(0).world_from_object[3].y;
  };
  EXPECT_EQ(height({}), 5.0f);
  EXPECT_EQ(height("walk"), 5.0f);
  EXPECT_EQ(height("run"), 4.0f);
  EXPECT_EQ(height("1"), 4.0f);
  EXPECT_TRUE(import_time(folder, gltf, 0.0).reported("of several animations the first is used"));
  try {
    height("fly");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    EXPECT_NE(std::string(error.what()).find("no animation \"fly\"; there are 0 (\"walk\"), 1 (\"run\")"),
              std::string::npos)
        << error.what();
  }
}

TEST(GltfMotion, WhatHasNoTrackStandsStill) {
  const SceneFolder folder;
  GltfBuilder flat = gltf_triangle();
  flat.json["scenes"][0]["nodes"] = Json::array();
  flat.node({{"children", {0}}, {"scale", {1, 2, 1}}});
  add_animation(flat,
                {{0, "scale", "LINEAR", {0, 1}, {1, 1, 1, 0, 1, 1}}, {0, "rotation", "LINEAR", {0, 1, 4}, kTurns}});
  const Imported imported = import_time(folder, flat, 0.0);
  EXPECT_TRUE(imported.reported("is flattened at 1 s; the node and all that hangs on it stand still"))
      << imported.text();
  EXPECT_EQ(unique_triangle_count(imported.scene), 1u);
  EXPECT_TRUE(imported.scene.motion.empty());

  GltfBuilder deep = gltf_triangle();
  std::vector<GltfChannel> channels = {{0, "translation", "LINEAR", {0, 1}, {0, 0, 0, 0, 5, 0}}};
  for (size_t i = 1; i < 70; ++i) {
    deep.json["nodes"].push_back({{"children", {i - 1}}});
    channels.push_back({i, "translation", "LINEAR", {0, 1}, {0, 0, 0, 0, 5, 0}});
  }
  deep.json["scenes"][0]["nodes"] = {69};
  add_animation(deep, channels);
  EXPECT_TRUE(import_time(folder, deep, 0.0)
                  .reported("under more than 64 moving nodes; the node and all that hangs on it stand still"));

  GltfBuilder same = gltf_triangle();
  add_animation(same, {{0, "translation", "LINEAR", {0, 1}, {0, 5, 0, 0, 5, 0}}});
  EXPECT_TRUE(import_time(folder, same, 0.0).scene.motion.empty());
}

TEST(GltfMotion, WrongChannelsAreLeftOut) {
  const SceneFolder folder;
  const GltfChannel up = {0, "translation", "LINEAR", {0, 1}, {0, 0, 0, 0, 5, 0}};
  GltfBuilder twice = gltf_triangle();
  add_animation(twice, {up, {0, "translation", "LINEAR", {0, 1}, {0, 0, 0, 9, 9, 9}}});
  const Imported one = import_time(folder, twice, 0.0);
  EXPECT_TRUE(one.reported("is the target of another channel, too; the channel is left out")) << one.text();
  EXPECT_EQ(one.scene.motion.tracks.at(0).keys.back().translation, DVec3(0, 5, 0));

  GltfBuilder matrix = gltf_triangle({{"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}}});
  add_animation(matrix, {up});
  const Imported still = import_time(folder, matrix, 0.0);
  EXPECT_TRUE(still.reported("is a node with a matrix; the channel is left out")) << still.text();
  EXPECT_TRUE(still.scene.motion.empty());
}

TEST(GltfMotion, KeysBeyondLimitsStandStill) {
  const SceneFolder folder;
  GltfBuilder far = gltf_triangle();
  add_animation(far, {{0, "scale", "LINEAR", {0, 1}, {1, 1, 1, 3e38f, 1, 1}}});
  const Imported imported = import_time(folder, far, 0.0);
  EXPECT_TRUE(imported.reported(
      "leaves the range of positions and scales at 1 s; the node and all that hangs on it stand still"))
      << imported.text();
  EXPECT_TRUE(imported.scene.motion.empty());

  GltfBuilder camera = gltf_triangle();
  camera.json["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 1.0}}}}};
  camera.node({{"camera", 0}});
  add_animation(camera, {{1, "scale", "LINEAR", {0, 1, 2}, {1, 1, 1, 0, 1, 1, 1, 1, 1}}});
  const Imported flat = import_time(folder, camera, 0.0);
  EXPECT_TRUE(flat.reported("is flattened or mirrored at 1 s; the camera stands still")) << flat.text();
  EXPECT_EQ(flat.scene.cameras.size(), 1u);
  EXPECT_TRUE(flat.scene.motion.empty());
}

TEST(GltfMotion, KeysAreCountedAsMemory) {
  const SceneFolder folder;
  GltfBuilder gltf = gltf_triangle();
  std::vector<float> times, places;
  for (int i = 0; i < 20'000; ++i) {
    times.push_back(static_cast<float>(i));
    places.insert(places.end(), {0.0f, static_cast<float>(i % 7), 0.0f});
  }
  add_animation(gltf, {{0, "translation", "LINEAR", times, places}});
  ImportOptions options;
  options.memory = MemoryBudget(4u << 20);
  EXPECT_THROW(import_time(folder, gltf, 0.0, options), MemoryError);
  options.memory = MemoryBudget(64u << 20);
  EXPECT_EQ(import_time(folder, gltf, 0.0, options).scene.motion.tracks.at(0).keys.size(), times.size());
}

ImportResult import_frames(const std::filesystem::path& file, double fps) {
  ImportOptions options;
  options.frames_per_second = fps;
  Diagnostics diagnostics;
  Progress progress;
  return import_scene(file, options, diagnostics, progress);
}

TEST(GltfSequences, FramesAreThePosesAtTheirTimes) {
  const SceneFolder folder;
  GltfBuilder gltf = gltf_skin();
  const Json target = {{"POSITION", gltf.positions({0, 0, 1, 0, 0, 0, 0, 0, 0})}};
  Json primitive = {{"attributes", {{"POSITION", gltf.positions({0, 0, 0, 1, 0, 0, 0, 1, 0})}}}};
  gltf.mesh(primitive); // stands still
  gltf.node({{"mesh", 1}});
  primitive["targets"] = {target};
  gltf.mesh(primitive);
  const size_t morphing = gltf.node({{"mesh", 2}, {"weights", {0}}});
  gltf.json["animations"].clear();
  add_animation(gltf, {{2, "translation", "LINEAR", {0, 2}, {0, 0, 5, 0, 8, 5}},
                       {morphing, "weights", "LINEAR", {0, 1}, {0, 3}},
                       {morphing, "translation", "LINEAR", {0, 2}, {0, 0, 0, 1, 0, 0}}}); // moves and deforms
  const std::filesystem::path file = folder.write("a.gltf", gltf.text());
  const ImportResult imported = import_frames(file, 4.0);
  const std::vector<MeshSequence>& sequences = imported.sequences;
  ASSERT_EQ(imported.scene.meshes.size(), 3u);
  ASSERT_EQ(sequences.size(), 2u);
  EXPECT_EQ(imported.scene.motion.instances.size(), 1u);
  for (const MeshSequence& sequence : sequences) {
    ASSERT_EQ(sequence.frames->count(), 8u); // 2 s
    EXPECT_EQ(sequence.frames_per_second, 4.0);
    for (uint32_t frame = 0; frame < 8; ++frame) {
      const Imported there = import_time(folder, gltf, frame / 4.0);
      EXPECT_EQ(sequence.frames->positions(frame), there.scene.meshes[sequence.mesh].positions) << frame;
    }
    EXPECT_NE(sequence.frames->positions(1), sequence.frames->positions(0));
  }
}

TEST(GltfSequences, FramesRepeatWithTheNodes) {
  const SceneFolder folder;
  GltfBuilder gltf = gltf_skin();
  gltf.json["animations"].clear();
  add_animation(gltf, {{2, "translation", "LINEAR", {0, 1, 2.1f}, {0, 0, 5, 0, 8, 5, 0, 0, 5}}});
  const ImportResult imported = import_frames(folder.write("a.gltf", gltf.text()), 4.0);
  const MeshSequence& sequence = imported.sequences.at(0);
  EXPECT_EQ(sequence.frames->count(), 8u);
  EXPECT_EQ(static_cast<double>(sequence.frames->count()) / sequence.frames_per_second, double{2.1f});
  const Imported there = import_time(folder, gltf, 5 / sequence.frames_per_second);
  EXPECT_EQ(sequence.frames->positions(5), there.scene.meshes[0].positions);
}

TEST(GltfSequences, VerticesWithoutTrianglesHaveNoFrames) {
  const SceneFolder folder;
  GltfBuilder gltf;
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  Json primitive = {{"attributes", {{"POSITION", gltf.positions({9, 9, 9, 0, 0, 0, 1, 0, 0, 0, 1, 0, kNone, 0, 0})}}},
                    {"indices", gltf.accessor<uint8_t>("SCALAR", 5121, {1, 2, 3, 1, 3, 4})}};
  primitive["targets"] = {{{"POSITION", gltf.positions({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1})}}};
  gltf.mesh(primitive);
  gltf.node({{"mesh", 0}, {"weights", {0}}});
  add_animation(gltf, {{0, "weights", "LINEAR", {0, 1}, {0, 4}}});
  const ImportResult imported = import_frames(folder.write("a.gltf", gltf.text()), 4.0);
  ASSERT_EQ(imported.sequences.size(), 1u);
  const MeshFrames& frames = *imported.sequences[0].frames;
  EXPECT_EQ(frames.positions(0), imported.scene.meshes.at(0).positions);
  EXPECT_EQ(frames.positions(2), (std::vector<Vec3>{{0, 0, 2}, {1, 0, 2}, {0, 1, 2}}));
  EXPECT_EQ(frames.name(2), "meshes[0].primitives[0] at 0.5 s");
}

TEST(GltfSequences, WithoutDeformationThereAreNone) {
  const SceneFolder folder;
  GltfBuilder moving = gltf_triangle();
  add_animation(moving, {{0, "translation", "LINEAR", {0, 1}, {0, 0, 0, 0, 5, 0}}});
  EXPECT_TRUE(import_frames(folder.write("a.gltf", moving.text()), 24.0).sequences.empty());
  GltfBuilder same = gltf_skin();
  same.json["animations"].clear();
  add_animation(same, {{2, "translation", "LINEAR", {0, 2}, {0, 3, 5, 0, 3, 5}}});
  EXPECT_TRUE(import_frames(folder.write("a.gltf", same.text()), 24.0).sequences.empty());
}

TEST(GltfSequences, PosesAreCountedAsMemoryBeforeTheyAreMade) {
  const SceneFolder folder;
  GltfBuilder gltf = gltf_skin();
  gltf.json["animations"].clear();
  add_animation(gltf, {{2, "translation", "LINEAR", {0, 1e6f}, {0, 0, 5, 0, 8, 5}}});
  const std::filesystem::path file = folder.write("a.gltf", gltf.text());
  ImportOptions options;
  options.memory = MemoryBudget(64u << 20);
  options.frames_per_second = 24.0;
  Diagnostics diagnostics;
  Progress progress;
  EXPECT_THROW(import_scene(file, options, diagnostics, progress), MemoryError);
  options.frames_per_second = 1e6;
  EXPECT_THROW(import_scene(file, options, diagnostics, progress), Error);
}

} // namespace
} // namespace packtrace
