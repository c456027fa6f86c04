#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "runtime/motion/displacements.h"
#include "runtime/motion/motion_keys.h"
#include "runtime/motion/scene_motion.h"
#include "tests/runtime/motion/moving_scenes.h"

namespace packtrace {
namespace {

class MotionKeys : public testing::Test {
protected:
  MotionKeys() {
    for (int i = 0; i < 3; ++i) {
      MotionTarget tree;
      tree.name = "tree", tree.placement[3] = Vec3(10.0f * static_cast<float>(i), 0, 0);
      tree.box.lo = DVec3(-1), tree.box.hi = DVec3(1, 3, 1);
      targets_.instances.push_back(tree);
    }
    targets_.instances.push_back({"ground", Affine(1.0f), {}, true});
  }

  RigidMotion read(const std::string& text) const {
    return read_motion_keys(folder_.write("keys.json", text), targets_);
  }

  /// The message without the folder.
  std::string problem(const std::string& text) const {
    try {
      (void)read(text);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kInput);
      std::string message = error.what();
      const size_t at = message.find("keys.json:");
      return at == std::string::npos ? message : message.substr(at);
    }
    return "accepted";
  }

  /// The message for one instance "tree" with these keys, written in line 2.
  std::string problem_of_keys(const std::string& keys) const {
    return problem("{\"instances\": [{\"name\": \"tree\", \"keys\": [\n" + keys + "]}]}");
  }

  SceneFolder folder_;
  MotionTargets targets_;
};

TEST_F(MotionKeys, ANameAddressesAllAndANumberOne) {
  const RigidMotion motion = read(R"({"instances": [
    {"name": "tree#1", "loop": true, "keys": [{"time": 0}, {"time": 2, "translate": [1, 2, 3]}]}]})");
  ASSERT_EQ(motion.instances.size(), 1u);
  EXPECT_EQ(motion.instances[0].instance, 1u);
  EXPECT_TRUE(motion.instances[0].relative);
  EXPECT_EQ(motion.instances[0].pivot, Vec3(10, 1, 0)); // the centre of the box
  EXPECT_TRUE(motion.tracks[0].loop);
  EXPECT_EQ(read(R"({"instances": [{"name": "tree", "keys": [{"time": 0}]}]})").instances.size(), 3u);
}

TEST_F(MotionKeys, DisplacementsAreWhatTheirKeysSay) {
  targets_.instances.push_back({"a \"b\" \\", Affine(1.0f), {}, false});
  const std::vector<Displacement> moved{{1, {0.1, -2e-7, 1e20}}, {2, {0, 0, 0}}, {4, {1.0 / 3.0, 0, 0}}};
  const RigidMotion expected = displacement_motion(moved, targets_),
                    read_back = read(displacement_keys(moved, targets_));
  ASSERT_EQ(read_back.instances.size(), moved.size());
  for (size_t i = 0; i < moved.size(); ++i) {
    EXPECT_EQ(read_back.instances[i].instance, moved[i].instance);
    EXPECT_EQ(read_back.instances[i].pivot, expected.instances[i].pivot);
    const MotionKey &key = read_back.tracks[read_back.instances[i].track].keys.at(0),
                    &wanted = expected.tracks[expected.instances[i].track].keys.at(0);
    EXPECT_EQ(key.translation, wanted.translation);
    EXPECT_EQ(key.rotation, wanted.rotation);
    EXPECT_EQ(key.scale, wanted.scale);
  }
}

TEST_F(MotionKeys, KeysMoveRelativeToThePlacement) {
  const RigidMotion motion = read(R"({"instances": [{"name": "tree#2", "pivot": [20, 0, 0], "keys": [
    {"time": 0}, {"time": 1, "translate": [0, 5, 0], "rotate": {"axis": [0, 2, 0], "degrees": 90}, "scale": 2}]}]})");
  SceneMotion scene;
  scene.add(motion, targets_);
  EXPECT_EQ(scene.begin_s(), 0.0);
  EXPECT_EQ(scene.end_s(), 1.0);
  EXPECT_EQ(scene.pose(0, 0.0), DAffine(targets_.instances[2].placement));
  const DVec3 p = transform_point(scene.pose(0, 1.0), DVec3(1, 0, 0)); // at rest (21, 0, 0)
  EXPECT_LT(glm::distance(p, DVec3(20, 5, -2)), 1e-12);
  const DVec3 halfway = transform_point(scene.pose(0, 0.5), DVec3(0, 0, 0));
  EXPECT_LT(glm::distance(halfway, DVec3(20, 2.5, 0)), 1e-12);
}

TEST_F(MotionKeys, QuaternionsAreXyzw) {
  const RigidMotion motion = read(R"({"instances": [{"name": "tree#0", "interpolation": "catmull-rom", "keys": [
    {"time": 0, "rotate": {"quaternion": [0, 3, 0, 3]}}, {"time": 1}]}]})");
  EXPECT_EQ(motion.tracks[0].interpolation, KeyInterpolation::kCatmullRom);
  EXPECT_NEAR(motion.tracks[0].keys[0].rotation.y, std::sqrt(0.5), 1e-12);
  EXPECT_NEAR(motion.tracks[0].keys[0].rotation.w, std::sqrt(0.5), 1e-12);
}

TEST_F(MotionKeys, PivotsAreWorldCoordinates) {
  targets_.origin = DVec3(1e6, 0, 0);
  const RigidMotion motion =
      read(R"({"instances": [{"name": "tree#0", "pivot": [1000001, 2, 3], "keys": [{"time": 0}]}]})");
  EXPECT_EQ(motion.instances[0].pivot, Vec3(1, 2, 3));
}

TEST_F(MotionKeys, UnknownNamesAreRefused) {
  const auto named = [&](const std::string& name) {
    return problem("{\"instances\": [{\"name\": \"" + name + "\", \"keys\": [{\"time\": 0}]}]}");
  };
  EXPECT_EQ(named("trea"), "keys.json:1:25: no instance has the name \"trea\"; did you mean \"tree\"?");
  EXPECT_EQ(named("trea#1"), "keys.json:1:25: no instance has the name \"trea#1\"; did you mean \"tree\"?");
  EXPECT_EQ(named("tree#3"), "keys.json:1:25: there is no instance 3 of \"tree\": it has 3, numbered from 0");
  EXPECT_EQ(named("tree#x"), "keys.json:1:25: no instance has the name \"tree#x\"; did you mean \"tree\"?");
  EXPECT_EQ(named("ground"), "keys.json:1:25: \"ground\" is part of the world's geometry, which cannot move; give its "
                             "keys to bake");
  EXPECT_EQ(problem("{\"instances\": [{\"name\": \"tree\", \"keys\": [{\"time\": 0}]},\n"
                    "{\"name\": \"tree#1\", \"keys\": [{\"time\": 0}]}]}"),
            "keys.json:2:10: instance 1 has keys already, in line 1");
}

TEST_F(MotionKeys, BadKeysAreRefusedWithTheirPlace) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "1:41: no keys"},
      {"{}", "2:1: a key without \"time\""},
      {"7", "2:1: a key must be an object"},
      {"{\"time\": 0}, {\"time\": 0}", "2:23: time 0 is not after the time of the key before, 0"},
      {"{\"time\": 1}, {\"time\": -1.5}", "2:23: time -1.5 is not after the time of the key before, 1"},
      {"{\"time\": \"a\"}", "2:10: time must be a number"},
      {"{\"time\": 1e40}", "2:10: time must be within +-1e30"},
      {"{\"time\": 0, \"time\": 1}", "2:13: \"time\" is given twice"},
      {"{\"time\": 0, \"tranlate\": [0, 0, 0]}", "2:25: unknown field \"tranlate\"; did you mean translate?"},
      {"{\"time\": 0, \"translate\": [0, 0]}", "2:26: translate must be [x, y, z]"},
      {"{\"time\": 0, \"translate\": [0, 0, null]}", "2:33: translate must be a number"},
      {"{\"time\": 0, \"scale\": 0}", "2:22: a scale of zero has no inverse"},
      {"{\"time\": 0, \"scale\": [1, 2, 0]}", "2:22: a scale of zero has no inverse"},
      {"{\"time\": 0},\n{\"time\": 1, \"scale\": -1}", "3:22: the scale changes its sign, so it passes through zero"},
      {"{\"time\": 0, \"rotate\": {\"axis\": [0, 0, 0], \"degrees\": 3}}", "2:32: the axis has length zero"},
      {"{\"time\": 0, \"rotate\": {\"quaternion\": [0, 0, 0, 0]}}", "2:38: the quaternion has length zero"},
      {"{\"time\": 0},\n{\"time\": 1, \"rotate\": {\"axis\": [0, 1, 0], \"degrees\": 270}}",
       "3:23: a turn by 270 degrees since the key before; turns between keys take the shorter way, so add keys less "
       "than 180 degrees apart"},
  };
  for (const auto& [keys, expected] : cases) EXPECT_EQ(problem_of_keys(keys), "keys.json:" + expected) << keys;
}

TEST_F(MotionKeys, BadFilesAreRefused) {
  EXPECT_EQ(problem("[]"), "keys.json:1:1: not an object with \"instances\"");
  EXPECT_EQ(problem("{}"), "keys.json:1:1: \"instances\" is missing");
  EXPECT_EQ(problem("{\"instances\": []}"), "keys.json:1:15: no instances");
  EXPECT_EQ(problem("{\"instances\": [], \"x\": 1}"), "keys.json:1:24: unknown field \"x\"");
  EXPECT_EQ(problem("{\"instances\": [\n  {\"name\": \"tree\",, }"),
            "keys.json:2:19: syntax error while parsing object key - unexpected ','; expected string literal");
  EXPECT_NE(problem("").find("keys.json:1:1: "), std::string::npos);
  EXPECT_NE(problem("{\"instances\": 1e999}").find("1:15: "), std::string::npos);
  EXPECT_NE(problem("{\"a\": \"\xff\"}").find("keys.json:1:8: "), std::string::npos);
  EXPECT_NE(problem(std::string(100000, '[')).find("keys.json:1:"), std::string::npos);
  EXPECT_THROW((void)read_motion_keys(folder_ / "missing.json", targets_), Error);
}

TEST_F(MotionKeys, MemoryIsReservedBeforeReading) {
  const std::filesystem::path file = folder_.write("large.json", "[" + std::string(100000, ' ') + "]");
  const MemoryBudget budget(1 << 20);
  EXPECT_THROW((void)read_motion_keys(file, targets_, budget), MemoryError);
}

TEST_F(MotionKeys, TheyReplaceTheMotionOfTheScene) {
  Scene scene = test::separate_carts();
  const size_t moving = scene.motion.instances.size();
  const RigidMotion keys = read_motion_keys(
      folder_.write("carts.json", R"({"instances": [{"name": "cart#1", "keys": [{"time": 0}, {"time": 9, "scale": 2}]},
                                                     {"name": "trianglemesh:19", "keys": [{"time": 1}]}]})"),
      [&] {
        MotionTargets targets = motion_targets(scene);
        targets.instances.front().name = "trianglemesh:19"; // the floor
        return targets;
      }());
  add_motion(scene.motion, keys);
  EXPECT_EQ(scene.motion.instances.size(), moving + 1);
  const SceneMotion motion = SceneMotion::of(scene);
  EXPECT_EQ(motion.end_s(), 9.0);
  EXPECT_EQ(motion.moving_instances().front(), 0u);
  const BakedFile file = BakedFile::from_bytes(test::bake(scene).bytes);
  EXPECT_EQ(file.geometries()[file.instances()[0].geometry].flags & baked::kWorldSpace, 0u);
  EXPECT_EQ(SceneMotion::of(file).end_s(), 9.0);
}

} // namespace
} // namespace packtrace
