// Scenes with errors: nothing is lost or overwritten without a message.

#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/end_to_end/command.h"
#include "tests/end_to_end/workbench.h"
#include "tests/pbrt_import/damaged_files.h"

namespace packtrace::test {
namespace {

constexpr const char* kPlyText =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
const std::string kTriangles = "Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point P\" [0 0 0  1 0 0  0 1 0]\n";

bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

// Outputs and inputs

class FilesOfAScene : public testing::Test {
protected:
  FilesOfAScene() {
    write_text(bench_ / "mesh.ply", kPlyText);
    write_text(bench_ / "wood.png", good_png());
    write_text(bench_ / "part.pbrt", kTriangles);
    write_text(bench_ / "sky.exr", "an environment map");
    write_text(scene_, "Camera \"perspective\" Film \"image\" \"string filename\" \"picture.png\"\nWorldBegin\n"
                       "LightSource \"infinite\" \"string mapname\" \"sky.exr\"\n"
                       "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"wood.png\"\n"
                       "Material \"matte\" \"texture Kd\" \"t\"\nShape \"plymesh\" \"string filename\" \"mesh.ply\"\n"
                       "Translate 0 0 1 Include \"part.pbrt\"\nWorldEnd\n");
    std::filesystem::create_hard_link(bench_ / "wood.png", bench_ / "link.png");
    std::filesystem::create_hard_link(bench_ / "mesh.ply", bench_ / "mesh.ptk");
    std::filesystem::create_hard_link(bench_ / "part.pbrt", bench_ / "part.json");
  }

  Workbench bench_;
  std::string scene_ = bench_ / "scene.pbrt";
};

TEST_F(FilesOfAScene, NoOutputReplacesThem) {
  const std::string baked = bench_ / "scene.ptk";
  ASSERT_EQ(run_packtrace({"bake", scene_, "-o", baked}).exit_code, 0);
  std::filesystem::create_hard_link(baked, bench_ / "baked.json");
  const std::string baked_bytes = read_text(baked);
  const std::vector<std::vector<std::string>> commands = {
      {"bake", scene_, "-o", bench_ / "mesh.ptk"},
      {"bake", scene_, "-o", baked, "--json", bench_ / "part.json"},
      {"bake", scene_, "--dry-run", "--json", bench_ / "part.json"},
      {"info", scene_, "--json", bench_ / "part.json"},
      {"info", baked, scene_, "--json", bench_ / "part.json"},
      {"info", baked, "--json", bench_ / "baked.json"},
      {"render", scene_, "-o", bench_ / "wood.png"},
      {"render", scene_, "-o", bench_ / "link.png"},
      {"render", scene_, "-o", bench_ / "sky.exr"},
      {"render", scene_, "-o", bench_ / "x.png", "--json", bench_ / "part.json"},
      {"render", baked, "-o", bench_ / "x.png", "--json", bench_ / "baked.json"},
      {"export", baked, "-o", bench_ / "x.glb", "--json", bench_ / "baked.json"},
      {"compare", bench_ / "wood.png", bench_ / "wood.png", "--diff", bench_ / "link.png"},
  };
  for (std::vector<std::string> command : commands) {
    command.emplace_back("--force");
    const CommandResult result = run_packtrace(command);
    EXPECT_EQ(result.exit_code, 2) << command[0] << " " << command.back() << result.err;
    EXPECT_TRUE(holds(result.err, "this file is read, so it cannot be the output")) << result.err;
  }
  EXPECT_EQ(read_text(bench_ / "mesh.ply"), kPlyText);
  EXPECT_EQ(read_text(bench_ / "wood.png"), good_png());
  EXPECT_EQ(read_text(bench_ / "part.pbrt"), kTriangles);
  EXPECT_EQ(read_text(bench_ / "sky.exr"), "an environment map");
  EXPECT_EQ(read_text(bench_ / "baked.json"), baked_bytes);
  EXPECT_EQ(read_text(bench_ / "part.json"), kTriangles);
}

TEST_F(FilesOfAScene, NoErrorReplacesThem) {
  write_text(bench_ / "part.json", "Nonsense\n" + kTriangles);
  write_text(scene_, "WorldBegin Include \"part.json\" WorldEnd\n");
  const std::vector<std::string> command{
      "bake", scene_, "-o", bench_ / "x.ptk", "--strict", "--json", bench_ / "part.json", "--force"};
  const CommandResult result = run_packtrace(command);
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_TRUE(holds(result.err, "part.json: not a JSON file, so the error is not written to it")) << result.err;
  EXPECT_EQ(read_text(bench_ / "part.json"), "Nonsense\n" + kTriangles);
}

TEST_F(FilesOfAScene, ThePictureOfItsFilmIsNoneOfThem) {
  write_text(bench_ / "picture.png", "an old picture");
  const CommandResult result =
      run_packtrace({"render", scene_, "-o", bench_ / "picture.png", "--force", "--frames", "1", "--size", "8x8"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

// Compressed scenes

TEST(CompressedScene, EveryVerbReadsIt) {
  const Workbench bench;
  const std::string scene = bench / "scene.pbrt.gz";
  write_text(bench / "part.pbrt", gzip(kTriangles));
  write_text(scene, gzip("WorldBegin\nInclude \"part.pbrt\"\n" + kTriangles + "WorldEnd\n"));
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{
           {"info", scene},
           {"bake", scene, "-o", bench / "scene.ptk"},
           {"render", scene, "-o", bench / "x.png", "--frames", "1", "--size", "8x8"}}) {
    const CommandResult result = run_packtrace(command);
    EXPECT_EQ(result.exit_code, 0) << result.err;
  }
  EXPECT_TRUE(holds(run_packtrace({"info", scene}).out, "triangles 2 "));
}

TEST(CompressedScene, WhatIsNoSceneIsRefusedAsIfItWereNotCompressed) {
  const Workbench bench;
  write_text(bench / "zeros.gz", gzip(std::string(1 << 20, '\0')));
  const CommandResult zeros = run_packtrace({"bake", bench / "zeros.gz", "-o", bench / "x.ptk"});
  EXPECT_EQ(zeros.exit_code, 3);
  EXPECT_TRUE(holds(zeros.err, "not a text file, so not a pbrt-v3 scene")) << zeros.err;
  write_text(bench / "cut.gz", without_end(gzip("WorldBegin\n" + kTriangles + "WorldEnd\n"), 9));
  const CommandResult cut = run_packtrace({"info", bench / "cut.gz"});
  EXPECT_TRUE(holds(cut.err, "truncated gzip data; the rest of the file is skipped")) << cut.err;
}

// Mesh files

TEST(MeshFilesAsScenes, EveryVerbReadsThem) {
  const Workbench bench;
  const std::string obj = bench / "a.obj", ply = bench / "b.ply", baked = bench / "both.ptk";
  write_text(obj, "v 0 0 1\nv 1 0 1\nv 0 1 1\nf 1 2 3\n");
  write_text(ply, kPlyText);
  const CommandResult bake = run_packtrace({"bake", obj, ply, "-o", baked, "--up", "z", "--scale", "2", "--json", "-"});
  ASSERT_EQ(bake.exit_code, 0) << bake.err;
  EXPECT_TRUE(holds(bake.out, "\"inputs\"")) << bake.out;
  EXPECT_TRUE(holds(run_packtrace({"info", baked}).out, "triangles 2 stored"));
  EXPECT_TRUE(holds(run_packtrace({"info", obj, "--scale", "3"}).out, "bounds 3 x 3 x 0"));
  const CommandResult render = run_packtrace({"render", obj, "-o", bench / "x.png", "--frames", "1", "--size", "8x8"});
  EXPECT_EQ(render.exit_code, 0) << render.err;
  ASSERT_EQ(run_packtrace({"bake", obj, "-o", bench / "one.ptk", "--scale", "2"}).exit_code, 0);
  const CommandResult compare = run_packtrace({"compare", bench / "one.ptk", obj, "--scale", "2"});
  EXPECT_EQ(compare.exit_code, 0) << compare.err;
}

TEST(MeshFilesAsScenes, OptionsWithoutUseAreRefused) {
  const Workbench bench;
  const std::string obj = bench / "a.obj", scene = bench / "a.pbrt", baked = bench / "a.ptk";
  write_text(obj, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  write_text(scene, "WorldBegin\n" + kTriangles + "WorldEnd\n");
  ASSERT_EQ(run_packtrace({"bake", scene, "-o", baked}).exit_code, 0);
  for (const auto& [command, problem] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"info", obj, "--world", "2"}, "--world only applies to .pbrt scenes"},
           {{"info", scene, "--up", "z"}, "--up only applies to mesh files"},
           {{"info", baked, "--scale", "2"}, "--scale does not apply to a .ptk file"},
           {{"bake", obj, scene, "-o", bench / "x.ptk"}, "only PLY, OBJ, STL and glTF files can be joined"},
           {{"bake", scene, obj, "-o", bench / "x.ptk"}, "only PLY, OBJ, STL and glTF files can be joined"},
           {{"bake", obj, obj, "-o", bench / "x.ptk", "--target", "size=1MB"}, "--target measures one file"}}) {
    const CommandResult result = run_packtrace(command);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_TRUE(holds(result.err, problem)) << result.err;
  }
  const CommandResult missing = run_packtrace({"bake", bench / "none.obj", "-o", bench / "x.ptk"});
  EXPECT_EQ(missing.exit_code, 3);
  EXPECT_TRUE(holds(missing.err, "none.obj: ")) << missing.err;
}

// Names

TEST(NamesOfAScene, NeedNotBeUtf8) {
  const Workbench bench;
  const std::string scene = bench / "caf\xe9.pbrt", baked = bench / "caf\xe9.ptk";
  write_text(scene, "Camera \"perspective\" Film \"image\" \"string filename\" \"\xfc.exr\"\nWorldBegin\n"
                    "MakeNamedMaterial \"gr\xfcn\" \"string type\" \"matte\" NamedMaterial \"gr\xfcn\"\n"
                    "ObjectBegin \"b\xe4um\"" +
                        kTriangles + "ObjectEnd\nTranslate 0 0 2 ObjectInstance \"b\xe4um\"\nWorldEnd\n");
  const std::vector<std::vector<std::string>> commands = {
      {"info", scene, "--json", "-"},
      {"bake", scene, "-o", baked, "--json", "-", "-v"},
      {"info", baked, "--json", "-", "-v"},
      {"render", baked, "-o", bench / "\xe9.png", "--json", "-", "--frames", "1", "--size", "8x8"},
      {"export", baked, "-o", bench / "\xe9.glb", "--json", "-"},
      {"compare", bench / "\xe9.png", bench / "\xe9.png", "--json", "-"},
  };
  for (const std::vector<std::string>& command : commands) {
    const CommandResult result = run_packtrace(command);
    EXPECT_EQ(result.exit_code, 0) << command[0] << result.err;
    EXPECT_FALSE(nlohmann::json::parse(result.out, nullptr, false).is_discarded()) << command[0] << result.out;
  }
  const std::string glb = read_text(bench / "\xe9.glb");
  EXPECT_TRUE(holds(glb, "b\u00e4um"));
  EXPECT_TRUE(holds(glb, "\u00fc.exr"));
}

TEST(NamesOfAScene, DoNotReachTheTerminalAsControlCharacters) {
  const Workbench bench;
  const std::string file = "a\x1b[31m\u202eb.pbrt";
  write_text(bench / file,
             "Camera \"perspective\" Film \"image\" \"string filename\" \"x\u202ey\"\nWorldBegin\nNonsense\n" +
                 kTriangles + "WorldEnd\n");
  const std::vector<std::vector<std::string>> commands = {
      {"info", bench / file},
      {"info", bench / ("missing" + file)},
      {"bake", bench / file, "-o", bench / (file + ".ptk"), "-v"},
      {"render", bench / file, "-o", bench / (file + ".png"), "--frames", "1", "--size", "8x8"},
      {"render", bench / file, "-o", bench / (file + ".jpg")},
  };
  for (const std::vector<std::string>& command : commands) {
    const CommandResult result = run_packtrace(command);
    for (const char* const raw : {"\x1b", "\u202e"}) EXPECT_FALSE(holds(result.out + result.err, raw)) << command[0];
    EXPECT_TRUE(holds(result.out + result.err, "\\xe2\\x80\\xae")) << command[0] << result.out << result.err;
  }
}

// Cameras

/// A ball fine enough for LOD levels; `options` defines a camera, which may or may not look at it.
std::string ball_scene(const std::string& options) {
  return options + "\nFilm \"image\" \"integer xresolution\" 32 \"integer yresolution\" 24\n"
                   "WorldBegin\nTranslate 0 0 10 Shape \"sphere\"\nWorldEnd\n";
}
const std::string kAway = "Scale 1 1 -1 Camera \"perspective\"";

TEST(CameraOfAScene, IsLeftOutBehindAnIgnoredTransformAndTheEndSaysSo) {
  const Workbench bench;
  const std::string scene = bench / "scene.pbrt", baked = bench / "scene.ptk";
  write_text(scene, ball_scene("Transform [1 0 0 0  0 1 0 0  0 0 1 .5  0 0 4 1] Camera \"perspective\""));
  const std::string line = "1 camera was skipped because of the errors above; render will show the whole scene\n";
  for (const std::vector<std::string>& command :
       std::vector<std::vector<std::string>>{{"info", scene}, {"bake", scene, "-o", baked}}) {
    const CommandResult result = run_packtrace(command);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_TRUE(holds(result.out, line)) << result.out;
  }
  const nlohmann::json info = nlohmann::json::parse(run_packtrace({"info", scene, "--json", "-"}).out, nullptr, false);
  EXPECT_EQ(info["cameras_left_out"], 1);
  EXPECT_EQ(info["cameras"], 0);
  for (const std::string& input : {scene, baked}) {
    const CommandResult result =
        run_packtrace({"render", input, "-o", bench / "x.png", "--force", "--frames", "1", "--json", "-"});
    EXPECT_TRUE(holds(result.err, "no camera; showing the whole scene")) << result.err;
    const nlohmann::json report = nlohmann::json::parse(result.out, nullptr, false);
    EXPECT_EQ(report["camera"],
              (nlohmann::json{{"index", nullptr}, {"frames_scene", true}, {"reason", "the scene has no camera"}}));
    EXPECT_GT(report["hit_pixels"], 1000);
  }
}

TEST(CameraOfAScene, ThatSeesNothingGivesWayToOneThatFramesTheScene) {
  const Workbench bench;
  const std::string scene = bench / "scene.pbrt", baked = bench / "scene.ptk";
  write_text(scene, ball_scene(kAway));
  ASSERT_EQ(run_packtrace({"bake", scene, "-o", baked, "--lod", "all"}).exit_code, 0);
  const std::vector<std::vector<std::string>> inputs = {
      {scene}, {baked}, {baked, "--lod-error", "1"}, {baked, "--lod-error", "1", "--lod-rays", "occlusion"}};
  for (const std::vector<std::string>& input : inputs) {
    std::vector<std::string> command{"render", "-o", bench / "x.png", "--force", "--frames", "2", "--json", "-"};
    command.insert(command.end(), input.begin(), input.end());
    const CommandResult result = run_packtrace(command);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_TRUE(
        holds(result.err,
              "warning: camera 0 sees nothing of the scene; showing the whole scene (--camera 0 keeps the camera)"))
        << result.err;
    const nlohmann::json report = nlohmann::json::parse(result.out, nullptr, false);
    EXPECT_EQ(report["camera"],
              (nlohmann::json{{"index", nullptr}, {"frames_scene", true}, {"reason", "camera 0 sees nothing"}}));
    EXPECT_GT(report["hit_pixels"], 100) << result.out;
    EXPECT_EQ(report["width"], 32);
    EXPECT_EQ(report["height"], 24);
    // Asking for that camera and size gives the same picture.
    command.insert(command.end(), {"--camera", "auto", "--size", "32x24"});
    const CommandResult framed = run_packtrace(command);
    EXPECT_EQ(framed.err, "");
    EXPECT_EQ(nlohmann::json::parse(framed.out, nullptr, false)["mean_ao"], report["mean_ao"]);
  }
}

TEST(CameraOfAScene, IsReplacedInSequencesToo) {
  const Workbench bench;
  const std::string scene = bench / "scene.pbrt";
  write_text(scene, ball_scene(kAway));
  for (const std::string path : {"orbit:30", "scene"}) {
    const auto render = [&](const std::string& name, const std::vector<std::string>& options) {
      std::vector<std::string> command{"render", scene, "--path", path, "--frames", "2", "--subframes", "1", "--force"};
      command.insert(command.end(), {"-o", bench / (name + "%d.png")});
      command.insert(command.end(), options.begin(), options.end());
      return run_packtrace(command);
    };
    const CommandResult result = render("own", {});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_TRUE(holds(result.err, "warning: camera 0 sees nothing of the scene; showing the whole scene"))
        << result.err;
    const CommandResult framed = render("auto", {"--camera", "auto", "--size", "32x24"});
    EXPECT_FALSE(holds(framed.err, "warning")) << framed.err;
    const CommandResult kept = render("kept", {"--camera", "0"});
    EXPECT_FALSE(holds(kept.err, "warning")) << kept.err;
    for (const char* const number : {"0.png", "1.png"}) {
      const std::string own = read_text(bench / (std::string("own") + number));
      EXPECT_EQ(own, read_text(bench / (std::string("auto") + number)));
      EXPECT_NE(own, read_text(bench / (std::string("kept") + number)));
    }
  }
}

TEST(CameraOfAScene, ThatWasAskedForStays) {
  const Workbench bench;
  write_text(bench / "scene.pbrt", ball_scene(kAway));
  const CommandResult result = run_packtrace(
      {"render", bench / "scene.pbrt", "-o", bench / "x.png", "--camera", "0", "--frames", "1", "--json", "-"});
  EXPECT_TRUE(holds(result.err, "this camera sees nothing of the scene; try --camera auto")) << result.err;
  const nlohmann::json report = nlohmann::json::parse(result.out, nullptr, false);
  EXPECT_EQ(report["camera"], (nlohmann::json{{"index", 0}, {"frames_scene", false}, {"reason", nullptr}}));
  EXPECT_EQ(report["hit_pixels"], 0);
}

TEST(CameraOfAScene, ThatSeesSomethingStays) {
  const Workbench bench;
  const nlohmann::json report = nlohmann::json::parse(
      run_packtrace({"render", bench.scene(), "-o", bench / "x.png", "--frames", "1", "--json", "-"}).out, nullptr,
      false);
  EXPECT_EQ(report["camera"], (nlohmann::json{{"index", 0}, {"frames_scene", false}, {"reason", nullptr}}));
}

} // namespace
} // namespace packtrace::test
