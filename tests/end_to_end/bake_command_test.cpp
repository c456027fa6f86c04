#include <filesystem>
#include <string>
#include <utility>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/end_to_end/workbench.h"
#include "tests/sanitized.h"

namespace packtrace::test {
namespace {

namespace fs = std::filesystem;

TEST(CommandLine, RequirementsAreExplainedInSentencesAndAsData) {
  const Workbench bench;
  write_text(bench / "textured.pbrt", R"(WorldBegin
Texture "checks" "spectrum" "checkerboard"
Material "matte" "texture Kd" "checks"
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [0 0 0  1 0 0  1 1 0.3  0 1 0] "float uv" [0 0 1 0 1 1 0 1]
WorldEnd
)");
  const std::string file = bench / "textured.ptk";
  const CommandResult ao = run_packtrace({"bake", bench / "textured.pbrt", "-o", file, "-v"});
  ASSERT_EQ(ao.exit_code, 0) << ao.err;
  for (const char* sentence :
       {"required for ao:", "uv dropped: no masked material, 2 triangles of 1 geometries, 32 source bytes saved",
        "normals: the source has none, 2 triangles of 1 geometries",
        "materials: 1 of 1 in use, at most 1 per geometry (0 bits); flags in use: albedo texture (1 of 12 bits); flags "
        "that ao uses: none",
        "triangles 2   instances 1   materials 1; normals: the source has none; uv dropped"})
    EXPECT_NE(ao.out.find(sentence), std::string::npos) << sentence << "\n" << ao.out;

  const CommandResult shading =
      run_packtrace({"bake", bench / "textured.pbrt", "-o", file, "-q", "--force", "--for", "shading"});
  ASSERT_EQ(shading.exit_code, 0) << shading.err;
  const CommandResult info = run_packtrace({"info", file, "-v", "--json", "-"});
  const auto requirements = nlohmann::json::parse(info.out).at("requirements");
  EXPECT_EQ(requirements.at("for"), "shading");
  EXPECT_EQ(requirements.at("streams").at(1).at("reason"), "texture");
  EXPECT_EQ(requirements.at("streams").at(1).at("source_bytes"), 32);
  EXPECT_GT(requirements.at("streams").at(1).at("stored_bytes"), 0);
  EXPECT_EQ(requirements.at("geometries").at(0).at("reasons").at("uv"), nlohmann::json({"texture"}));
  EXPECT_FALSE(nlohmann::json::parse(run_packtrace({"info", file, "--json", "-"}).out)
                   .at("requirements")
                   .contains("geometries"));
  EXPECT_NE(run_packtrace({"info", file}).out.find("uv kept: used by textures, 2 triangles"), std::string::npos);

  EXPECT_EQ(run_packtrace({"bake", bench.scene(), "--dry-run", "--for", "beauty"}).exit_code, 2);
  EXPECT_EQ(run_packtrace({"bake", bench.scene(), "--dry-run", "--keep", "uv,colours"}).exit_code, 2);
}

TEST(CommandLine, SequencesArePackedAndReported) {
  const Workbench bench;
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  for (const char* frame : {"1", "2", "3"})
    write_text(bench / ("leaf_0" + std::string(frame) + ".ply"), header + "0 0 0\n1 0 0\n0 1 " + frame + "\n3 0 1 2\n");
  write_text(bench / "leaf.pbrt", "WorldBegin\nShape \"plymesh\" \"string filename\" \"leaf_01.ply\"\nWorldEnd\n");
  const std::string file = bench / "leaf.ptk";
  const std::vector<std::string> bake{"bake",    bench / "leaf.pbrt", "-o",           file,
                                      "--force", "--sequence",        "leaf_%02d.ply"};
  const CommandResult baked = run_packtrace(bake);
  ASSERT_EQ(baked.exit_code, 0) << baked.err;
  EXPECT_NE(baked.out.find("leaf_01.ply deforms: 3 frames from number 1 at 24 per second, 3 vertices"),
            std::string::npos)
      << baked.out;
  const auto info = nlohmann::json::parse(run_packtrace({"info", file, "--json", "-"}).out);
  EXPECT_EQ(info.at("sequences").at(0).at("frames"), 3);
  EXPECT_GT(info.at("bytes").at("deformation"), 0);
  EXPECT_EQ(run_packtrace({"render", file, "-o", bench / "leaf.png", "--size", "16x16", "--frames", "1"}).exit_code, 0);

  const auto fails = [&](std::vector<std::string> more, int code, const char* part) {
    std::vector<std::string> all = bake;
    all.insert(all.end(), more.begin(), more.end());
    const CommandResult result = run_packtrace(all);
    EXPECT_EQ(result.exit_code, code);
    EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
  };
  fails({"--sequence-start", "2"}, 3, "did you mean leaf_01.ply?");
  fails({"--sequence-fps", "0"}, 2, "--sequence-fps");
  fails({"--sequence-group", "65"}, 2, "frames per group");
  fails({"--target", "size=3MB"}, 2, "--target");
  fails({"--sequence", "leaf_%02d.ply"}, 2, "two sequences");
  fails({"--sequence", "leaf.ply"}, 2, "it has no number");
  EXPECT_EQ(run_packtrace({"bake", bench / "leaf.pbrt", "--dry-run", "--sequence-fps", "30"}).exit_code, 2);
}

TEST(CommandLine, LevelsByDistanceAreStoredAndReported) {
  const Workbench bench;
  write_text(bench / "balls.pbrt", "WorldBegin\nObjectBegin \"ball\"\nShape \"sphere\"\nObjectEnd\n"
                                   "ObjectBegin \"pot\"\nShape \"cylinder\"\nObjectEnd\n"
                                   "ObjectInstance \"ball\"\nTranslate 3 0 0\nObjectInstance \"ball\"\nWorldEnd\n");
  const std::string file = bench / "balls.ptk", levels = bench / "levels.json";
  const std::vector<std::string> bake{"bake", bench / "balls.pbrt", "-o", file, "--force", "--distance-levels", levels};
  write_text(levels, R"({"chains": [{"objects": ["ball", "pot"], "distances": [4.5]}]})");
  const CommandResult baked = run_packtrace(bake);
  ASSERT_EQ(baked.exit_code, 0) << baked.err;
  EXPECT_NE(baked.out.find("2 instances show ball, pot from distances 0, 4.5 on"), std::string::npos) << baked.out;
  const auto info = nlohmann::json::parse(run_packtrace({"info", file, "--json", "-"}).out);
  EXPECT_EQ(info.at("distance_levels").at(0).at("geometries"), nlohmann::json({"ball", "pot"}));
  EXPECT_EQ(info.at("distance_levels").at(0).at("distances"), nlohmann::json({4.5}));
  EXPECT_EQ(info.at("distance_levels").at(0).at("instances"), 2);
  EXPECT_EQ(run_packtrace({"render", file, "--path", "turntable", "--frames", "2", "--subframes", "1", "-o",
                           bench / "b_%d.png", "--size", "16x16"})
                .exit_code,
            0);

  const auto fails = [&](const std::string& text, int code, const char* part) {
    write_text(levels, text);
    const CommandResult result = run_packtrace(bake);
    EXPECT_EQ(result.exit_code, code) << text;
    EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
  };
  fails(R"({"chains": [{"objects": ["ball", "pott"], "distances": [4]}]})", 3, "did you mean \"pot\"?");
  fails(R"({"chains": [{"objects": ["ball", "ball"], "distances": [4]}]})", 3, "is given already, in line 1");
  fails(R"({"chains": [{"objects": ["ball"], "distances": []}]})", 3, "2 to 8 objects, not 1");
  fails(R"({"chains": [{"objects": ["ball", "pot"], "distances": [4, 5]}]})", 3, "2 objects need 1 distances, not 2");
  fails(R"({"chains": [{"objects": ["ball", "pot"], "distances": [-4]}]})", 3, "levels.json:1:");
  fails(R"({"chains": [{"objects": ["ball", "pot"]}]})", 3, "\"distances\" is missing");
  fails(R"({"chains": [{"objects": ["ball", "pot"], "distances": [4], "far": 1}]})", 3, "far");
  fails(R"({"chains": []})", 3, "no chains");
}

TEST(CommandLine, LevelsOfDetailAreReported) {
  const Workbench bench;
  write_text(bench / "ball.pbrt", "WorldBegin\nObjectBegin \"ball\"\nShape \"sphere\"\nObjectEnd\n"
                                  "ObjectInstance \"ball\"\nTranslate 3 0 0\nObjectInstance \"ball\"\n"
                                  "Translate 3 0 0\nShape \"paraboloid\"\nWorldEnd\n");
  const std::string file = bench / "ball.ptk";
  const auto bake = [&](std::vector<std::string> options) {
    std::vector<std::string> arguments{"bake", bench / "ball.pbrt", "-o", file, "--force"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return run_packtrace(arguments);
  };
  const CommandResult instanced = bake({"--lod", "instanced", "--lod-levels", "3"});
  ASSERT_EQ(instanced.exit_code, 0) << instanced.err;
  EXPECT_NE(instanced.out.find("3 coarser LOD levels for 1 geometries: "), std::string::npos) << instanced.out;
  const auto lod = nlohmann::json::parse(run_packtrace({"info", file, "-v", "--json", "-"}).out).at("lod");
  ASSERT_EQ(lod.at("levels").size(), 4u);
  EXPECT_EQ(lod.at("geometries"), 1);
  EXPECT_EQ(lod.at("by_geometry").at(0).at("name"), "ball");
  EXPECT_EQ(lod.at("levels").at(0).at("max_error"), 0.0);
  EXPECT_GT(lod.at("levels").at(3).at("max_error"), lod.at("levels").at(1).at("max_error"));
  EXPECT_LT(lod.at("levels").at(1).at("triangles"), 0.6 * lod.at("triangles").get<double>());
  EXPECT_NE(run_packtrace({"info", file}).out.find("LOD levels of 1 geometries"), std::string::npos);

  ASSERT_EQ(bake({"--lod", "all"}).exit_code, 0);
  EXPECT_EQ(nlohmann::json::parse(run_packtrace({"info", file, "--json", "-"}).out).at("lod").at("geometries"), 2);
  ASSERT_EQ(bake({"--lod", "all", "--lod-min-triangles", "1000000"}).exit_code, 0);
  EXPECT_TRUE(nlohmann::json::parse(run_packtrace({"info", file, "--json", "-"}).out).at("lod").is_null());

  for (const auto& wrong : std::vector<std::vector<std::string>>{{"--lod", "some"},
                                                                 {"--lod-levels", "3"},
                                                                 {"--lod-min-triangles", "3"},
                                                                 {"--resume", "x"},
                                                                 {"--lod", "all", "--lod-levels", "0"},
                                                                 {"--lod", "all", "--lod-levels", "32"}})
    EXPECT_EQ(bake(wrong).exit_code, 2) << wrong.back();
}

TEST(CommandLine, ExistingOutputIsKeptWithoutForce) {
  const Workbench bench;
  bench.bake();
  write_text(bench.baked(), "mine");
  const CommandResult refused = run_packtrace({"bake", bench.scene(), "-o", bench.baked()});
  EXPECT_EQ(refused.exit_code, 6);
  EXPECT_NE(refused.err.find("--force"), std::string::npos) << refused.err;
  EXPECT_EQ(read_text(bench.baked()), "mine");
  EXPECT_EQ(run_packtrace({"bake", bench.scene(), "-o", bench.baked(), "--force"}).exit_code, 0);
  EXPECT_NE(read_text(bench.baked()), "mine");
}

TEST(CommandLine, TheInputIsNeverOverwritten) {
  const Workbench bench;
  EXPECT_EQ(run_packtrace({"bake", bench.scene(), "-o", bench.scene(), "--force"}).exit_code, 2);
  EXPECT_EQ(read_text(bench.scene()), small_scene_text());
}

TEST(CommandLine, AnEmptySceneSaysWhy) {
  const Workbench bench;
  std::string text = small_scene_text();
  for (size_t at = text.find("Shape"); at != std::string::npos; at = text.find("Shape", at + 40))
    text.insert(text.find('\n', at), " \"float alpha\" [0]");
  write_text(bench / "clear.pbrt", text);
  const CommandResult result = run_packtrace({"bake", bench / "clear.pbrt", "-o", bench.baked()});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_NE(result.err.find("note:"), std::string::npos) << result.err;
}

TEST(CommandLine, MissingMeshIsOneLocatedErrorAndTheRestIsBaked) {
  const Workbench bench;
  std::string text = small_scene_text();
  text.insert(text.find("WorldEnd"), "Shape \"plymesh\" \"string filename\" [\"gone.ply\"]\n");
  write_text(bench / "holes.pbrt", text);
  const CommandResult result =
      run_packtrace({"bake", bench / "holes.pbrt", "-o", bench / "holes.ptk", "--json", bench / "holes.json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.err.find("holes.pbrt:8:"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("gone.ply"), std::string::npos) << result.err;
  EXPECT_EQ(nlohmann::json::parse(read_text(bench / "holes.json")).at("triangles").get<int>(), 4);
  EXPECT_EQ(run_packtrace({"bake", bench / "holes.pbrt", "-o", bench / "strict.ptk", "--strict"}).exit_code, 3);
  EXPECT_FALSE(fs::exists(bench / "strict.ptk"));
}

TEST(CommandLine, TheBakedFileIsTheSameForAnyThreadCount) {
  const Workbench bench;
  for (const char* threads : {"1", "2", "5"})
    ASSERT_EQ(run_packtrace({"bake", bench.scene(), "-o", bench / threads, "--threads", threads, "-q"}).exit_code, 0);
  EXPECT_EQ(read_text(bench / "1"), read_text(bench / "2"));
  EXPECT_EQ(read_text(bench / "1"), read_text(bench / "5"));
}

TEST(CommandLine, DryRunReportsAndWritesNothing) {
  const Workbench bench;
  const CommandResult result = run_packtrace({"bake", bench.scene(), "-o", bench.baked(), "--dry-run", "--json", "-"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(nlohmann::json::parse(result.out).at("triangles").get<int>(), 4);
  EXPECT_FALSE(fs::exists(bench.baked()));
}

/// Two balls on a floor 1000 units wide: the floor's median edge is unrelated to the visible detail.
std::string balls_on_a_floor() {
  return "LookAt 6 3 -8  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" [45]\nWorldBegin\n"
         "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3]"
         " \"point P\" [-500 -1 -500  -500 -1 500  500 -1 500  500 -1 -500]\n"
         "ObjectBegin \"ball\"\nShape \"sphere\"\nObjectEnd\n"
         "Translate -1.2 0 0\nObjectInstance \"ball\"\nTranslate 2.4 0 0\nObjectInstance \"ball\"\nWorldEnd\n";
}

TEST(CommandLine, TheDefaultPrecisionKeepsThePicture) {
  if (sanitized()) GTEST_SKIP() << kOthersRunItsCode;
  const Workbench bench;
  const std::string scene = bench / "balls.pbrt", file = bench / "balls.ptk";
  write_text(scene, balls_on_a_floor());
  const CommandResult bake = run_packtrace({"bake", scene, "-o", file, "--json", bench / "bake.json"});
  ASSERT_EQ(bake.exit_code, 0) << bake.err;
  EXPECT_EQ(bake.err.find("too coarse for accurate ambient occlusion"), std::string::npos) << bake.err;
  const nlohmann::json report = nlohmann::json::parse(read_text(bench / "bake.json"));
  EXPECT_TRUE(report.at("promise").at("kept").get<bool>());
  EXPECT_GE(report.at("finer_geometries").get<int>(), 1);
  for (const auto& [input, image] : {std::pair{scene, "float.exr"}, {file, "packed.exr"}}) {
    const CommandResult render =
        run_packtrace({"render", input, "-o", bench / image, "--ground-truth", "--spp", "64", "--frames", "16",
                       "--size", "160x90", "--seed", "1", "--aov", "ao", "-q"});
    ASSERT_EQ(render.exit_code, 0) << render.err;
  }
  const CommandResult compare =
      run_packtrace({"compare", bench / "float.exr", bench / "packed.exr", "--layer", "ao", "--json", "-"});
  const nlohmann::json difference = nlohmann::json::parse(compare.out);
  EXPECT_LE(difference.at("metrics").at("mae").get<double>(), 0.005);
  EXPECT_LE(difference.at("mismatched_pixels").get<double>(), 0.001 * 160 * 90);
}

TEST(CommandLine, WhatAPrecisionLosesIsSaidInTheLastLines) {
  const Workbench bench;
  const std::string scene = bench / "balls.pbrt";
  write_text(scene, balls_on_a_floor());
  const CommandResult bake =
      run_packtrace({"bake", scene, "-o", bench / "balls.ptk", "--precision-abs", "3", "--json", bench / "bake.json"});
  ASSERT_EQ(bake.exit_code, 0) << bake.err;
  const size_t said = bake.err.find("warning: the grid is too coarse for accurate ambient occlusion: ");
  ASSERT_NE(said, std::string::npos) << bake.err;
  EXPECT_EQ(bake.err.find("warning", said + 1), std::string::npos) << "it is not last: " << bake.err;
  EXPECT_NE(bake.err.find("without a precision option, bake chooses steps that are fine enough", said),
            std::string::npos);
  const nlohmann::json promise = nlohmann::json::parse(read_text(bench / "bake.json")).at("promise");
  EXPECT_FALSE(promise.at("kept").get<bool>());
  ASSERT_FALSE(promise.at("geometries").empty());
  for (const nlohmann::json& geometry : promise.at("geometries"))
    EXPECT_LT(geometry.at("wanted").get<double>(), geometry.at("step").get<double>()) << geometry;
}

} // namespace
} // namespace packtrace::test
