#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/end_to_end/workbench.h"
#include "tests/sanitized.h"

namespace packtrace::test {
namespace {

namespace fs = std::filesystem;

/// Many instances of a ball in front of a camera, with LOD levels.
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

/// The town's houses stand on its ground, each on a grid of its own, so seams may open.
TEST(CommandLine, SeamsOfInstancesAreStatedAndSaidWhereTheyShow) {
  if (sanitized()) GTEST_SKIP() << kOthersRunItsCode;
  const TemporaryFolder folder;
  const std::string file = folder / "town.ptk", json = folder / "x.json";
  const std::string scene = std::string(PACKTRACE_SOURCE_DIR) + "/assets/town/town.pbrt";
  CommandResult result = run_packtrace({"bake", scene, "-o", file, "--lod", "all", "--json", json});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto baked = nlohmann::json::parse(read_text(json)).at("seams");
  EXPECT_GT(baked.at("touching"), 5000u);
  EXPECT_GT(baked.at("largest_gap"), 0.0);
  EXPECT_NE(result.err.find("seams may gape by up to"), std::string::npos) << result.err;
  result = run_packtrace({"info", file, "--json", json, "--force"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(nlohmann::json::parse(read_text(json)).at("seams"), baked);
  EXPECT_NE(result.out.find("seams may open by up to"), std::string::npos) << result.out;
  const auto render = [&](std::vector<std::string> options) {
    options.insert(options.begin(), {"render", file, "-o", folder / "x.png", "--size", "160x90", "--frames", "1",
                                     "--no-denoise", "--force", "--json", json});
    result = run_packtrace(options);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return nlohmann::json::parse(read_text(json)).at("seams");
  };
  const auto whole = render({});
  EXPECT_GT(whole.at("visible"), 100u);
  EXPECT_EQ(whole.at("of_detail_px"), 0.0);
  EXPECT_LT(whole.at("largest_px"), 0.5);
  EXPECT_EQ(result.out.find("seams"), std::string::npos) << result.out;
  const auto coarse = render({"--lod-error", "2"});
  EXPECT_GT(coarse.at("of_detail_px"), 0.5);
  EXPECT_LE(coarse.at("of_detail_px"), 4.0); // sum of both sides
  EXPECT_GT(coarse.at("above_half_a_pixel"), 0u);
  EXPECT_NE(result.out.find("seams     may open by up to"), std::string::npos) << result.out;
  EXPECT_EQ(render({"--lod-error", "2", "--lod-rays", "occlusion"}), whole);
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
  if (sanitized()) GTEST_SKIP() << kOthersRunItsCode;
  const BallsBench bench;
  ASSERT_EQ(run_packtrace({"bake", bench.scene(), "-o", bench.baked(), "--lod", "all"}).exit_code, 0);
  for (const char* scheme : {"steps", "one-provider", "off"}) {
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
  bench.bake(); // without LOD levels
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
                                             {"--lod-error", "1", "--lod-scheme", "per-level"},
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

TEST(CommandLine, ExistingPictureIsKeptWithoutForce) {
  const Workbench bench;
  bench.bake();
  for (const char* name : {"out.png", "out.exr"}) {
    write_text(bench / name, "mine");
    EXPECT_EQ(run_packtrace({"render", bench.baked(), "-o", bench / name, "--frames", "1"}).exit_code, 6);
    EXPECT_EQ(read_text(bench / name), "mine");
  }
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
  check_report("packed"); // the default backend for .ptk files
  ASSERT_EQ(render({"--bvh", "high"}), 0);
  check_report("embree"); // --bvh belongs to this backend
  ASSERT_EQ(render({"--backend", "embree", "--bvh-quality", "high"}), 0);
  check_report("embree");
  EXPECT_EQ(render({"--backend", "fast"}), 2);
  EXPECT_EQ(render({"--backend", "packed", "--bvh", "high"}), 2);
  EXPECT_EQ(render({"--backend", "embree-clusters"}), 2);
}

TEST(CommandLine, TexturesOfTheFileLookLikeThoseOfTheScene) {
  if (sanitized()) GTEST_SKIP() << kOthersRunItsCode;
  const TemporaryFolder directory;
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
  EXPECT_EQ(run_packtrace({"export", baked, "-o", directory / "u.xyz"}).exit_code, 2) << "which layout?";
  EXPECT_EQ(run_packtrace({"export", baked, "-o", directory / "u.v16", "--level", "3"}).exit_code, 2) << "of gltf";
  EXPECT_EQ(run_packtrace({"bake", scene, "-o", baked, "--force", "--texture-psnr", "40"}).exit_code, 2);
  EXPECT_EQ(run_packtrace({"bake", scene, "-o", baked, "--force", "--textures", "bc1"}).exit_code, 2) << "not for ao";
  EXPECT_EQ(run_packtrace({"bake", scene, "-o", baked, "--force", "-q", "--textures", "none"}).exit_code, 0);
}

TEST(RenderCommand, QuarterResolutionTracesAQuarterOfTheRays) {
  const Workbench bench;
  bench.bake();
  const auto render = [&](const std::string& resolution, std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"render", bench.baked(), "-o", bench / (resolution + ".exr"), "--force", "--size",
                               "63x41", "--spp", "64", "--frames", "2", "--ao-resolution", resolution, "--json", "-"});
    return run_packtrace(more);
  };
  for (const std::vector<std::string>& denoise : {std::vector<std::string>{}, {"--no-denoise"}}) {
    const nlohmann::json full = nlohmann::json::parse(render("full", denoise).out),
                         quarter = nlohmann::json::parse(render("quarter", denoise).out);
    EXPECT_EQ(full["rays"]["ao"], full["hit_pixels"].get<uint64_t>() * 128);
    EXPECT_NEAR(quarter["rays"]["ao"].get<double>(), full["rays"]["ao"].get<double>() / 4,
                0.02 * full["rays"]["ao"].get<double>());
    EXPECT_EQ(quarter["hit_pixels"], full["hit_pixels"]);
    EXPECT_NEAR(quarter["mean_ao"].get<double>(), full["mean_ao"].get<double>(), 0.003);
    const CommandResult same = run_packtrace(
        {"compare", bench / "quarter.exr", bench / "full.exr", "--max-mismatch", "0", "--max-rmse", "0.03"});
    EXPECT_EQ(same.exit_code, 0) << same.out << same.err;
  }
  EXPECT_EQ(render("half").exit_code, 2);
  EXPECT_EQ(render("quarter", {"--ground-truth"}).exit_code, 2);
}

TEST(RenderCommand, RatesAndSettingsOfOcclusionRaysAreChosen) {
  const Workbench bench;
  bench.bake();
  const auto render = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"render", bench.baked(), "-o", bench / "a.exr", "--force", "--size", "64x40", "--frames",
                               "4", "--no-jitter", "--json", "-"});
    return run_packtrace(more);
  };
  const nlohmann::json full = nlohmann::json::parse(render({}).out);
  const nlohmann::json half = nlohmann::json::parse(render({"--ao-rate", "checkerboard"}).out);
  EXPECT_EQ(half["rays"]["ao"].get<uint64_t>() * 2, full["rays"]["ao"].get<uint64_t>());
  EXPECT_NEAR(half["mean_ao"].get<double>(), full["mean_ao"].get<double>(), 0.01);
  const nlohmann::json sorted = nlohmann::json::parse(render({"--ao-set", "sort_rays=on"}).out);
  EXPECT_EQ(sorted["mean_ao"], full["mean_ao"]);
  const nlohmann::json dark = nlohmann::json::parse(render({"--ao-set", "falloff=off", "--ao-set=radius=9"}).out);
  EXPECT_EQ(dark["ao_radius"], 9.0);
  EXPECT_LT(dark["mean_ao"].get<double>(), full["mean_ao"].get<double>());
  for (const char* sampler : {"sobol", "jitter", "lattice", "independent"})
    EXPECT_NEAR(nlohmann::json::parse(render({"--ao-sampler", sampler, "--spp", "16"}).out)["mean_ao"].get<double>(),
                full["mean_ao"].get<double>(), 0.01);
  EXPECT_NE(render({"--ao-set", "lambda=21"}).err.find("lambda is 21, not in [0..20]"), std::string::npos);
  EXPECT_NE(render({"--ao-set", "lamda=2"}).err.find("did you mean lambda?"), std::string::npos);
  EXPECT_NE(render({"--ao-radius", "0"}).err.find("--ao-radius 0: must be a positive number"), std::string::npos);
  for (const std::vector<std::string>& wrong :
       {std::vector<std::string>{"--ao-rate", "half"}, {"--ao-rate", "checkerboard", "--ground-truth"}})
    EXPECT_EQ(render(wrong).exit_code, 2);
}

} // namespace
} // namespace packtrace::test
