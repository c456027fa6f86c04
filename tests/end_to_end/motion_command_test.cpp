// What bake and info do with motion.

#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/end_to_end/workbench.h"
#include "tests/pbrt_import/gltf_documents.h"

namespace packtrace::test {
namespace {

class MotionCommand : public testing::Test {
protected:
  nlohmann::json bake(std::vector<std::string> options) const {
    std::vector<std::string> arguments{"bake", scene_, "-o", file_, "--force", "--json", "-"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const CommandResult result = run_packtrace(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return nlohmann::json::parse(result.out, nullptr, false);
  }

  std::string keys(const std::string& text) const {
    write_text(bench_ / "keys.json", text);
    return bench_ / "keys.json";
  }

  Workbench bench_;
  std::string scene_ = PACKTRACE_SOURCE_DIR "/assets/features/animated_transform.pbrt";
  std::string file_ = bench_ / "moving.ptk";
};

TEST_F(MotionCommand, BakeKeepsMotionAndSaysWhatMoves) {
  const nlohmann::json report = bake({});
  const nlohmann::json& motion = report.at("motion");
  EXPECT_EQ(motion.at("instances"), 2);
  EXPECT_EQ(motion.at("begin_s"), 0.0);
  EXPECT_EQ(motion.at("end_s"), 1.0);
  EXPECT_EQ(motion.at("geometries").at(1), nlohmann::json({{"name", "block"}, {"instances", 1}}));
  EXPECT_GT(motion.at("max_error"), 0.0);
  EXPECT_LT(motion.at("max_error"), report.at("max_position_error_bound"));
  EXPECT_GT(report.at("bytes").at("rigid_motion"), 0);
  const CommandResult info = run_packtrace({"info", file_});
  EXPECT_NE(info.out.find("moving   instances 2   cameras 0   from 0 s to 1 s   (2 tracks, 4 keys"), std::string::npos)
      << info.out;
  EXPECT_NE(info.out.find("  block (1)\n"), std::string::npos);
}

TEST_F(MotionCommand, MotionMayBeLeftOut) {
  const nlohmann::json report = bake({"--motion", "off"});
  EXPECT_EQ(report.at("motion").at("instances"), 0);
  EXPECT_TRUE(report.at("motion").at("end_s").is_null());
  EXPECT_EQ(report.at("bytes").at("rigid_motion"), 0);
  EXPECT_EQ(run_packtrace({"info", file_}).out.find("moving"), std::string::npos);
  EXPECT_EQ(run_packtrace({"bake", scene_, "--dry-run", "--motion", "some"}).exit_code, 2);
}

/// A square passes a camera from 0 to 1 s, and a skin bends beside it from 0 to 2 s in another animation.
class GltfMotionCommand : public MotionCommand {
protected:
  GltfMotionCommand() {
    GltfBuilder gltf = gltf_skin();
    const nlohmann::json square = {{"attributes", {{"POSITION", gltf.positions(kSquare)}}},
                                   {"indices", gltf.accessor<uint16_t>("SCALAR", 5123, {0, 1, 2, 0, 2, 3})}};
    const size_t mesh = gltf.mesh(square), node = gltf.node({{"mesh", mesh}});
    gltf.json["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 1.0}, {"znear", 0.1}}}}};
    gltf.node({{"camera", 0}, {"translation", {0, 0, 6}}});
    add_animation(gltf, {{node, "translation", "LINEAR", {0, 1}, {-4, 0, 0, 2, 0, 0}}}, "pass");
    scene_ = bench_ / "moving.gltf";
    write_text(scene_, gltf.text());
  }
};

TEST_F(GltfMotionCommand, NodesMoveInPictures) {
  const nlohmann::json motion = bake({"--animation", "pass"}).at("motion");
  EXPECT_EQ(motion.at("instances"), 1);
  EXPECT_EQ(motion.at("end_s"), 1.0);
  EXPECT_EQ(bake({"--animation", "pass", "--motion", "off"}).at("motion").at("instances"), 0);
  const auto exported = [&] {
    return run_packtrace({"export", file_, "-o", bench_ / "x.glb", "--force"}).out.find("motion is left out");
  };
  EXPECT_EQ(exported(), std::string::npos);
  bake({"--animation", "pass"});
  EXPECT_NE(exported(), std::string::npos);
  const auto pictures = [&](const std::string& file, const std::string& name, std::vector<std::string> more) {
    std::vector<std::string> words{"render",   file,    "-o",          bench_ / (name + "_%d.png"),
                                   "--path",   "scene", "--fps",       "2",
                                   "--frames", "3",     "--subframes", "1",
                                   "--size",   "32x18", "-q"};
    words.insert(words.end(), more.begin(), more.end());
    const CommandResult result = run_packtrace(words);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    std::vector<std::string> bytes;
    for (int i = 0; i < 3; ++i) bytes.push_back(read_text(bench_ / (name + "_" + std::to_string(i) + ".png")));
    return bytes;
  };
  for (const auto& [file, more] :
       {std::pair{file_, std::vector<std::string>{}}, {scene_, std::vector<std::string>{"--animation", "pass"}}}) {
    const std::vector<std::string> shown = pictures(file, file == file_ ? "baked" : "scene", more);
    EXPECT_NE(shown[0], shown[1]) << file;
  }
}

TEST_F(GltfMotionCommand, SkinsAreSequences) {
  const nlohmann::json report = bake({"--sequence", "animation", "--sequence-fps", "4"});
  ASSERT_EQ(report.at("sequences").size(), 1u) << report;
  EXPECT_EQ(report.at("sequences")[0].at("frames"), 8);
  const auto refused = [&](const std::string& scene, const std::string& animation, const std::string& what) {
    const CommandResult result =
        run_packtrace({"bake", scene, "-o", file_, "--force", "--sequence", "animation", "--animation", animation});
    EXPECT_NE(result.exit_code, 0);
    EXPECT_NE(result.err.find(what), std::string::npos) << result.err;
  };
  refused(scene_, "pass", "no animation deforms its meshes");
  refused(scene_, "fly", "there is no animation \"fly\"");
  refused(bench_.scene(), "0", "--sequence animation only applies to glTF files");
}

TEST_F(MotionCommand, TheSameBytesForAnyNumberOfThreads) {
  bake({"--threads", "1"});
  const std::string one = read_text(file_);
  bake({"--threads", "3"});
  EXPECT_EQ(read_text(file_), one);
}

TEST_F(MotionCommand, KeysAreStored) {
  const std::string path = keys(R"({"instances": [{"name": "block#0", "interpolation": "catmull-rom", "keys": [
    {"time": 0}, {"time": 2, "translate": [0, 1, 0]}, {"time": 5}]}]})");
  const nlohmann::json motion = bake({"--keys", path}).at("motion");
  EXPECT_EQ(motion.at("instances"), 2); // the keys replace the block's own motion
  EXPECT_EQ(motion.at("keys"), 5);
  EXPECT_EQ(motion.at("end_s"), 5.0);
  EXPECT_EQ(bake({"--keys", path, "--motion", "off"}).at("motion").at("instances"), 1);
}

TEST_F(MotionCommand, BadKeysAreRefusedWithTheirPlace) {
  const auto run = [&](const std::string& path) {
    return run_packtrace({"bake", scene_, "-o", file_, "--keys", path});
  };
  const CommandResult unknown = run(keys("{\"instances\": [\n  {\"name\": \"blok\", \"keys\": [{\"time\": 0}]}]}"));
  EXPECT_EQ(unknown.exit_code, 3);
  EXPECT_NE(unknown.err.find("keys.json:2:12: no instance has the name \"blok\"; did you mean \"block\"?"),
            std::string::npos)
      << unknown.err;
  EXPECT_EQ(run(bench_ / "missing.json").exit_code, 3);
  EXPECT_EQ(run(bench_ / "").exit_code, 3); // a folder
}

} // namespace
} // namespace packtrace::test
