// Every exit code and every promise of the command line about files, tried on the program itself.

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/end_to_end/command.h"

namespace packtrace::test {
namespace {

namespace fs = std::filesystem;

size_t file_count(const fs::path& directory) {
  return static_cast<size_t>(std::distance(fs::directory_iterator(directory), fs::directory_iterator()));
}

/// A directory with the small scene in it and, on request, its baked file.
class Workbench {
public:
  Workbench() { write_text(scene(), small_scene_text()); }
  std::string scene() const { return directory_ / "small.pbrt"; }
  std::string baked() const { return directory_ / "small.ptk"; }
  std::string operator/(const std::string& name) const { return directory_ / name; }
  const fs::path& path() const { return directory_.path(); }
  void bake() const {
    const CommandResult result = run_packtrace({"bake", scene(), "-o", baked(), "-q"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }

private:
  TemporaryDirectory directory_;
};

TEST(CommandLine, HelpNamesEveryVerb) {
  const CommandResult result = run_packtrace({"--help"});
  EXPECT_EQ(result.exit_code, 0);
  for (const char* verb : {"bake", "info", "render", "compare", "export"})
    EXPECT_NE(result.out.find(verb), std::string::npos) << verb;
}

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
       {"required for ao:", "uv dropped: no masked material, 2 triangles of 1 geometries, 32 bytes of source saved",
        "normals: the source has none, 2 triangles of 1 geometries",
        "materials: 1 of 1 in use, at most 1 in one geometry (0 bits); flags in use: albedo texture (1 of 12 bits), ao "
        "looks at: none",
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
  EXPECT_NE(run_packtrace({"info", file}).out.find("uv kept: textures look them up, 2 triangles"), std::string::npos);

  EXPECT_EQ(run_packtrace({"bake", bench.scene(), "--dry-run", "--for", "beauty"}).exit_code, 2);
  EXPECT_EQ(run_packtrace({"bake", bench.scene(), "--dry-run", "--keep", "uv,colours"}).exit_code, 2);
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
  EXPECT_NE(instanced.out.find("3 levels of detail of 1 geometries: "), std::string::npos) << instanced.out;
  const auto lod = nlohmann::json::parse(run_packtrace({"info", file, "-v", "--json", "-"}).out).at("lod");
  ASSERT_EQ(lod.at("levels").size(), 4u);
  EXPECT_EQ(lod.at("geometries"), 1);
  EXPECT_EQ(lod.at("by_geometry").at(0).at("name"), "ball");
  EXPECT_EQ(lod.at("levels").at(0).at("max_error"), 0.0);
  EXPECT_GT(lod.at("levels").at(3).at("max_error"), lod.at("levels").at(1).at("max_error"));
  EXPECT_LT(lod.at("levels").at(1).at("triangles"), 0.6 * lod.at("triangles").get<double>());
  EXPECT_NE(run_packtrace({"info", file}).out.find("levels of detail of 1 geometries"), std::string::npos);

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

/// Many placements of a ball before a camera, with levels of detail.
class BallsBench : public Workbench {
public:
  BallsBench() {
    std::string text = "LookAt 0 2 -6  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 40\n"
                       "Film \"image\" \"integer xresolution\" 80 \"integer yresolution\" 48\nWorldBegin\n"
                       "ObjectBegin \"ball\"\nShape \"sphere\"\nObjectEnd\n";
    for (int i = 0; i < 30; ++i)
      text += "AttributeBegin\nTranslate " + std::to_string(i % 5 * 3 - 6) + " -1 " + std::to_string(i / 5 * 9) +
              "\nObjectInstance \"ball\"\nAttributeEnd\n";
    write_text(scene(), text + "WorldEnd\n");
  }
  CommandResult render(const std::vector<std::string>& options) const {
    std::vector<std::string> arguments{"render", baked(), "-o", *this / "x.png", "--force", "--frames", "1"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return run_packtrace(arguments);
  }
};

TEST(CommandLine, DetailIsChosenByItsErrorInPixels) {
  const BallsBench bench;
  ASSERT_EQ(run_packtrace({"bake", bench.scene(), "-o", bench.baked(), "--lod", "instanced"}).exit_code, 0);
  const std::string json = bench / "x.json";
  const auto render = [&](std::vector<std::string> options) {
    options.insert(options.end(), {"--json", json});
    const CommandResult result = bench.render(options);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return nlohmann::json::parse(read_text(json));
  };
  for (const char* backend : {"embree", "packed"}) {
    EXPECT_FALSE(render({"--backend", backend}).contains("lod"));
    const std::string whole = read_text(bench / "x.png");
    const auto off = render({"--backend", backend, "--lod-error", "1", "--lod-scheme", "off"}).at("lod");
    EXPECT_EQ(read_text(bench / "x.png"), whole);
    uint64_t last = off.at("traced_triangles");
    for (const char* error : {"0.05", "0.5", "4"}) {
      const auto report = render({"--backend", backend, "--lod-error", error}).at("lod");
      EXPECT_EQ(report.at("scheme"), "steps");
      EXPECT_LT(report.at("traced_triangles"), last) << error;
      last = report.at("traced_triangles");
      EXPECT_LE(report.at("traced_ratio"), 1.25 + 1e-9);
      EXPECT_LE(report.at("builds"), report.at("own_cuts").at("builds"));
      uint64_t instances = 0;
      for (const auto& [category, count] : report.at("categories").items()) instances += count.get<uint64_t>();
      EXPECT_EQ(instances, 30u);
      const auto& trees = report.at("trees");
      EXPECT_GT(trees.at("resident_bytes"), 0u);
      EXPECT_GE(trees.at("worst_case_bytes"), trees.at("resident_bytes"));
      uint64_t resident = 0;
      for (const auto& row : trees.at("geometries")) resident += row.at("resident_bytes").get<uint64_t>();
      EXPECT_EQ(trees.at("resident_bytes"), resident);
    }
    EXPECT_NE(read_text(bench / "x.png"), whole);
  }
}

TEST(CommandLine, DetailForOcclusionRaysLeavesWhatTheCameraSees) {
  const BallsBench bench;
  ASSERT_EQ(run_packtrace({"bake", bench.scene(), "-o", bench.baked(), "--lod", "all"}).exit_code, 0);
  const auto render = [&](std::vector<std::string> options) {
    options.insert(options.end(), {"--no-denoise", "--spp", "16", "--aov", "ao,depth", "--json", bench / "x.json"});
    const CommandResult result = bench.render(options);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return nlohmann::json::parse(read_text(bench / "x.json"));
  };
  for (const char* backend : {"embree", "packed"}) {
    const double mean = render({"--backend", backend}).at("mean_ao");
    const std::string depth = read_text(bench / "x.depth.png"), ao = read_text(bench / "x.ao.png");
    const auto coarse = render({"--backend", backend, "--lod-error", "1", "--lod-rays", "occlusion"});
    EXPECT_EQ(read_text(bench / "x.depth.png"), depth);
    EXPECT_NE(read_text(bench / "x.ao.png"), ao);
    EXPECT_NEAR(coarse.at("mean_ao"), mean, 0.01);
    EXPECT_LT(coarse.at("lod").at("traced_triangles"),
              render({"--backend", backend, "--lod-error", "0.1"}).at("lod").at("traced_triangles"));
    const auto culled = render({"--backend", backend, "--lod-error", "1", "--lod-rays", "occlusion", "--lod-cull",
                                "visible", "--lod-culled-scale", "8"});
    EXPECT_EQ(read_text(bench / "x.depth.png"), depth);
    EXPECT_GT(culled.at("lod").at("instances_culled"), coarse.at("lod").at("instances_culled"));
    EXPECT_LT(culled.at("lod").at("instances_culled"), 30u);
  }
}

TEST(CommandLine, DetailLooksTheSameForAnyNumberOfThreads) {
  const BallsBench bench;
  ASSERT_EQ(run_packtrace({"bake", bench.scene(), "-o", bench.baked(), "--lod", "all"}).exit_code, 0);
  for (const char* scheme : {"steps", "per-level", "one-provider", "per-instance"}) {
    const auto pictures = [&](const char* threads) {
      const CommandResult result = bench.render({"--backend", "packed", "--lod-error", "0.2", "--lod-scheme", scheme,
                                                 "--aov", "ao,lod,lod-error", "--threads", threads});
      EXPECT_EQ(result.exit_code, 0) << result.err;
      EXPECT_NE(result.out.find(scheme), std::string::npos) << result.out;
      return read_text(bench / "x.ao.png") + read_text(bench / "x.lod.png") + read_text(bench / "x.lod-error.png");
    };
    EXPECT_EQ(pictures("1"), pictures("4")) << scheme;
  }
}

TEST(CommandLine, DetailThatCannotBeIsAUsageError) {
  const BallsBench bench;
  bench.bake(); // without levels
  const CommandResult none = bench.render({"--lod-error", "1"});
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_NE(none.err.find("no levels of detail; bake it with --lod"), std::string::npos) << none.err;
  EXPECT_EQ(run_packtrace({"render", bench.scene(), "-o", bench / "x.png", "--lod-error", "1"}).exit_code, 2);
  for (const auto& wrong :
       std::vector<std::vector<std::string>>{{"--lod-error", "0"},
                                             {"--lod-error", "-1"},
                                             {"--lod-error", "nan"},
                                             {"--lod-scheme", "steps"},
                                             {"--lod-tolerance", "1"},
                                             {"--lod-error", "1", "--lod-scheme", "some"},
                                             {"--lod-error", "1", "--lod-traced-ratio", "0.5"},
                                             {"--lod-error", "1", "--lod-culled-scale", "0"},
                                             {"--lod-error", "1", "--lod-tolerance", "33"},
                                             {"--lod-rays", "occlusion"},
                                             {"--lod-error", "1", "--lod-rays", "camera"},
                                             {"--lod-error", "1", "--lod-cull", "some"},
                                             {"--lod-error", "1", "--lod-cull", "visible"},
                                             {"--lod-error", "1", "--lod-rays", "occlusion", "--aov", "lod"},
                                             {"--aov", "lod"}}) {
    const CommandResult result = bench.render(wrong);
    EXPECT_EQ(result.exit_code, 2) << wrong.back();
    EXPECT_EQ(result.err.find("internal"), std::string::npos) << result.err;
  }
  EXPECT_FALSE(fs::exists(bench / "x.png"));
}

TEST(CommandLine, NothingToDoIsAUsageError) { EXPECT_EQ(run_packtrace({}).exit_code, 2); }

TEST(CommandLine, UnknownVerbIsAUsageErrorThatNamesIt) {
  const CommandResult result = run_packtrace({"polish", "x"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("polish"), std::string::npos) << result.err;
}

TEST(CommandLine, PlannedVerbSaysThatItIsNotThereYet) {
  for (const char* verb : {"measure", "view"}) {
    const CommandResult result = run_packtrace({verb});
    EXPECT_EQ(result.exit_code, 4) << verb;
    EXPECT_NE(result.err.find(verb), std::string::npos) << result.err;
  }
}

TEST(CommandLine, OptionOutOfRangeIsAUsageErrorAndWritesNothing) {
  const Workbench bench;
  for (const auto& [option, value] :
       {std::pair{"--precision", "0"}, std::pair{"--precision", "-1"}, std::pair{"--precision", "nan"},
        std::pair{"--precision-abs", "inf"}, std::pair{"--position-bits", "0"}, std::pair{"--position-bits", "99"}}) {
    const CommandResult result = run_packtrace({"bake", bench.scene(), "-o", bench.baked(), option, value});
    EXPECT_EQ(result.exit_code, 2) << option << ' ' << value << '\n' << result.err;
  }
  EXPECT_EQ(file_count(bench.path()), 1u);
}

TEST(CommandLine, MissingInputIsAnInputErrorThatNamesTheFile) {
  const TemporaryDirectory directory;
  for (const char* name : {"none.pbrt", "none.ptk"}) {
    for (const char* verb : {"info", "render", "bake"}) {
      std::vector<std::string> arguments = {verb, directory / name};
      if (arguments[0] != "info") arguments.insert(arguments.end(), {"-o", directory / "out.png"});
      const CommandResult result = run_packtrace(arguments);
      EXPECT_EQ(result.exit_code, 3) << verb << ' ' << name << '\n' << result.err;
      EXPECT_NE(result.err.find(name), std::string::npos) << result.err;
    }
  }
  EXPECT_EQ(file_count(directory.path()), 0u);
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

TEST(CommandLine, ExistingPictureIsKeptWithoutForce) {
  const Workbench bench;
  bench.bake();
  for (const char* name : {"out.png", "out.exr"}) {
    write_text(bench / name, "mine");
    EXPECT_EQ(run_packtrace({"render", bench.baked(), "-o", bench / name, "--frames", "1"}).exit_code, 6);
    EXPECT_EQ(read_text(bench / name), "mine");
  }
}

TEST(CommandLine, UnwritableOutputIsAnIoErrorAndLeavesNothing) {
  const Workbench bench;
  bench.bake();
  const size_t before = file_count(bench.path());
  const std::string nowhere = bench / "no/such/folder/out.";
  EXPECT_EQ(run_packtrace({"bake", bench.scene(), "-o", nowhere + "ptk"}).exit_code, 6);
  EXPECT_EQ(run_packtrace({"render", bench.baked(), "-o", nowhere + "png"}).exit_code, 6);
  EXPECT_EQ(run_packtrace({"render", bench.baked(), "-o", nowhere + "exr"}).exit_code, 6);
  EXPECT_EQ(file_count(bench.path()), before);
}

TEST(CommandLine, UnknownImageFormatIsAUsageError) {
  const Workbench bench;
  bench.bake();
  const CommandResult result = run_packtrace({"render", bench.baked(), "-o", bench / "out.webp"});
  EXPECT_EQ(result.exit_code, 2) << result.err;
}

TEST(CommandLine, TwoPicturesInOneFileAreAUsageErrorAndWriteNothing) {
  const Workbench bench;
  for (const char* same : {"a.png", "./a.png"}) {
    const CommandResult result =
        run_packtrace({"render", bench.scene(), "--force", "-o", bench / "a.png", "-o", bench / same});
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_NE(result.err.find("a.png: two outputs"), std::string::npos) << result.err;
    EXPECT_EQ(file_count(bench.path()), 1u);
  }
}

TEST(CommandLine, ALayerNamedTwiceIsWrittenOnce) {
  const Workbench bench;
  for (const char* name : {"a.png", "a.exr"}) {
    const CommandResult result =
        run_packtrace({"render", bench.scene(), "--frames", "1", "--aov", "ao,ao", "-o", bench / name});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_TRUE(fs::exists(bench / name));
  }
}

TEST(CommandLine, PicturesAreCheckedBeforeTheSceneIsRead) {
  const Workbench bench;
  const CommandResult result = run_packtrace({"render", bench / "missing.pbrt", "-o", bench / "a.jpg"});
  EXPECT_EQ(result.exit_code, 2) << result.err;
}

TEST(CommandLine, EmptySceneIsAnInputError) {
  const Workbench bench;
  write_text(bench / "empty.pbrt", "WorldBegin\nWorldEnd\n");
  const CommandResult baked = run_packtrace({"bake", bench / "empty.pbrt", "-o", bench / "empty.ptk"});
  EXPECT_EQ(baked.exit_code, 3) << baked.err;
  EXPECT_NE(baked.err.find("no triangles"), std::string::npos) << baked.err;
  EXPECT_FALSE(fs::exists(bench / "empty.ptk"));
}

TEST(CommandLine, SceneWithoutCameraIsFramedWithAWarning) {
  const Workbench bench;
  std::string text = small_scene_text();
  text.erase(0, text.find("WorldBegin"));
  write_text(bench / "bare.pbrt", text);
  ASSERT_EQ(run_packtrace({"bake", bench / "bare.pbrt", "-o", bench / "bare.ptk"}).exit_code, 0);
  const CommandResult result = run_packtrace({"render", bench / "bare.ptk", "-o", bench / "bare.png", "--size", "64x48",
                                              "--frames", "1", "--json", bench / "bare.json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.err.find("camera"), std::string::npos) << result.err;
  const auto report = nlohmann::json::parse(read_text(bench / "bare.json"));
  EXPECT_GT(report.at("hit_pixels").get<int>(), 64 * 48 / 10) << "the default camera must see the scene";
}

TEST(CommandLine, CameraNumberOutOfRangeIsAUsageError) {
  const Workbench bench;
  bench.bake();
  EXPECT_EQ(run_packtrace({"render", bench.baked(), "-o", bench / "x.png", "--camera", "7"}).exit_code, 2);
}

TEST(CommandLine, RenderNamesItsBackend) {
  const Workbench bench;
  bench.bake();
  const auto render = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments = {"render", bench.baked(), "-o",     bench / "x.png", "--frames",
                                          "1",      "--force",     "--json", bench / "x.json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_packtrace(arguments).exit_code;
  };
  const auto check_report = [&](const char* backend) {
    const auto report = nlohmann::json::parse(read_text(bench / "x.json"));
    EXPECT_EQ(report.at("backend"), backend);
    EXPECT_FALSE(report.at("isa").get<std::string>().empty());
    uint64_t sum = 0;
    for (const auto& [name, bytes] : report.at("resident_bytes").at("parts").items()) sum += bytes.get<uint64_t>();
    EXPECT_EQ(report.at("resident_bytes").at("tracing"), sum);
  };
  ASSERT_EQ(render({}), 0);
  check_report("packed"); // what a .ptk file is made for
  ASSERT_EQ(render({"--bvh", "high"}), 0);
  check_report("embree"); // whose option that is
  ASSERT_EQ(render({"--backend", "embree", "--bvh-quality", "high"}), 0);
  check_report("embree");
  ASSERT_EQ(render({"--backend", "embree-clusters"}), 0);
  check_report("embree-clusters");
  EXPECT_EQ(render({"--backend", "fast"}), 2);
  EXPECT_EQ(render({"--backend", "packed", "--bvh", "high"}), 2);
  EXPECT_EQ(render({"--backend", "embree-clusters", "--fast-edges"}), 2);
  EXPECT_EQ(render({"--backend", "embree-clusters", "--lod-error", "1"}), 2);
}

TEST(CommandLine, EveryTruncatedPrefixOfABakedFileIsRefused) {
  const Workbench bench;
  bench.bake();
  const std::string bytes = read_text(bench.baked());
  ASSERT_GT(bytes.size(), 200u);
  // The library test tries every length; here a spread of them goes through the program.
  for (size_t length = 0; length < bytes.size(); length += std::max<size_t>(1, bytes.size() / 40)) {
    write_text(bench / "cut.ptk", bytes.substr(0, length));
    const CommandResult result = run_packtrace({"info", bench / "cut.ptk"});
    EXPECT_EQ(result.exit_code, 3) << length << " of " << bytes.size() << " bytes\n" << result.err;
    EXPECT_NE(result.err.find("cut.ptk"), std::string::npos) << result.err;
  }
}

TEST(CommandLine, FlippedBitsInABakedFileAreRefused) {
  const Workbench bench;
  bench.bake();
  const std::string bytes = read_text(bench.baked());
  for (size_t i = 0; i < 40; ++i) {
    std::string damaged = bytes;
    const size_t at = i * (bytes.size() - 1) / 39;
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << (i % 8)));
    write_text(bench / "bad.ptk", damaged);
    const int code = run_packtrace({"info", bench / "bad.ptk"}).exit_code;
    EXPECT_TRUE(code == 3 || code == 4) << "byte " << at << " exit " << code; // 4: the version field itself
  }
}

TEST(CommandLine, AnotherVersionIsUnsupported) {
  const Workbench bench;
  bench.bake();
  std::string bytes = read_text(bench.baked());
  bytes[8] = static_cast<char>(bytes[8] + 1); // FileHeader::version, docs/baked_format.md
  write_text(bench / "new.ptk", bytes);
  const CommandResult result = run_packtrace({"info", bench / "new.ptk"});
  EXPECT_EQ(result.exit_code, 4) << result.err;
  EXPECT_NE(result.err.find("version"), std::string::npos) << result.err;
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

TEST(CommandLine, QuietSaysNothingAndJsonOnStandardOutputIsAllThereIs) {
  const Workbench bench;
  const CommandResult result = run_packtrace({"bake", bench.scene(), "-o", bench.baked(), "-q", "--json", "-"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err, "");
  EXPECT_EQ(nlohmann::json::parse(result.out).at("triangles").get<int>(), 4);
}

TEST(CommandLine, DryRunReportsAndWritesNothing) {
  const Workbench bench;
  const CommandResult result = run_packtrace({"bake", bench.scene(), "-o", bench.baked(), "--dry-run", "--json", "-"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(nlohmann::json::parse(result.out).at("triangles").get<int>(), 4);
  EXPECT_FALSE(fs::exists(bench.baked()));
}

TEST(CommandLine, CompareBeyondALimitExitsWithFive) {
  const Workbench bench;
  bench.bake();
  ASSERT_EQ(run_packtrace({"render", bench.baked(), "-o", bench / "a.exr", "--frames", "1", "--no-denoise"}).exit_code,
            0);
  ASSERT_EQ(run_packtrace({"render", bench.baked(), "-o", bench / "b.exr", "--frames", "64"}).exit_code, 0);
  EXPECT_EQ(run_packtrace({"compare", bench / "a.exr", bench / "a.exr", "--layer", "ao", "--max-rmse", "0"}).exit_code,
            0);
  EXPECT_EQ(run_packtrace({"compare", bench / "a.exr", bench / "b.exr", "--layer", "ao", "--max-rmse", "0"}).exit_code,
            5);
}

TEST(CommandLine, TexturesOfTheFileLookLikeThoseOfTheScene) {
  const TemporaryDirectory directory;
  const std::string scene = PACKTRACE_SOURCE_DIR "/assets/textured/textured.pbrt", baked = directory / "t.ptk";
  const auto render = [&](const std::string& from, const std::string& to) {
    return run_packtrace({"render", from, "-o", to, "--aov", "albedo", "--frames", "1", "--size", "160x90", "--force"})
        .exit_code;
  };
  const auto compare = [&](const char* psnr) {
    return run_packtrace(
               {"compare", directory / "t.exr", directory / "truth.exr", "--layer", "albedo", "--min-psnr", psnr})
        .exit_code;
  };
  ASSERT_EQ(render(scene, directory / "truth.exr"), 0);
  ASSERT_EQ(run_packtrace({"bake", scene, "-o", baked, "-q"}).exit_code, 0);
  ASSERT_EQ(render(baked, directory / "t.exr"), 0);
  EXPECT_EQ(compare("30"), 5) << "averages are no textures";
  ASSERT_EQ(run_packtrace({"bake", scene, "-o", baked, "-q", "--force", "--for", "shading"}).exit_code, 0);
  ASSERT_EQ(render(baked, directory / "t.exr"), 0);
  EXPECT_EQ(compare("38"), 0);
  const CommandResult info = run_packtrace({"info", baked});
  EXPECT_NE(info.out.find("texture bricks: 128 x 128, bc1, 8,192 bytes, PSNR 41."), std::string::npos) << info.out;
  const CommandResult exported = run_packtrace({"export", baked, "-o", directory / "t.v16", "--layout", "vertex16"});
  EXPECT_EQ(exported.exit_code, 0) << exported.err;
  EXPECT_NE(exported.out.find("9,816 triangles in 5 draws of 5 geometries"), std::string::npos) << exported.out;
  EXPECT_EQ(run_packtrace({"export", baked, "-o", directory / "t.v16"}).exit_code, 6) << "it is there already";
  EXPECT_EQ(run_packtrace({"export", directory / "t.v16", "-o", directory / "u.v16"}).exit_code, 3);
  EXPECT_EQ(run_packtrace({"export", baked, "-o", directory / "u.v16", "--layout", "obj"}).exit_code, 2);
  EXPECT_EQ(run_packtrace({"bake", scene, "-o", baked, "--force", "--texture-psnr", "40"}).exit_code, 2);
  EXPECT_EQ(run_packtrace({"bake", scene, "-o", baked, "--force", "--textures", "bc1"}).exit_code, 2) << "not for ao";
  EXPECT_EQ(run_packtrace({"bake", scene, "-o", baked, "--force", "-q", "--textures", "none"}).exit_code, 0);
}

} // namespace
} // namespace packtrace::test
