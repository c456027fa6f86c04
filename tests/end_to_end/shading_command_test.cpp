// Baking for shading, and shaded pictures.

#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/end_to_end/workbench.h"

namespace packtrace::test {
namespace {

/// A floor, a mirror ball, and lights, or none.
class ShadedBench : public Workbench {
public:
  explicit ShadedBench(
      const std::string& lights = "LightSource \"point\" \"point from\" [0 4 -2] \"rgb I\" [20 20 20]\n") {
    write_text(scene(),
               "LookAt 0 2 -6  0 0.5 0  0 1 0\nCamera \"perspective\" \"float fov\" 40\n"
               "Film \"image\" \"integer xresolution\" 48 \"integer yresolution\" 32\nWorldBegin\n" +
                   lights +
                   "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-5 0 -5 -5 0 5 5 0 5 "
                   "5 0 -5]\nMaterial \"mirror\"\nTranslate 0 1 0\nShape \"sphere\"\nWorldEnd\n");
  }
  CommandResult render(const std::string& input, std::vector<std::string> more) const {
    more.insert(more.begin(), {"render", input, "-o", *this / "x.png", "--force", "--frames", "2"});
    return run_packtrace(more);
  }
};

TEST(Shading, FilesForItHoldMaterialsAndLights) {
  const ShadedBench bench;
  ASSERT_EQ(run_packtrace({"bake", bench.scene(), "-o", bench.baked(), "--for", "shading"}).exit_code, 0);
  const nlohmann::json info = nlohmann::json::parse(run_packtrace({"info", bench.baked(), "--json", "-"}).out);
  EXPECT_GT(info.at("bytes").at("shading_materials"), 0);
  EXPECT_EQ(info.at("bytes").at("lights"), 4 + 12 + 24);
  EXPECT_EQ(info.at("bytes").at("environment_maps"), 0);
  const CommandResult shaded = bench.render(bench.baked(), {"--view", "pbr+ao", "--json", "-"});
  ASSERT_EQ(shaded.exit_code, 0) << shaded.err;
  const nlohmann::json report = nlohmann::json::parse(shaded.out);
  EXPECT_EQ(report.at("view"), "pbr+ao");
  EXPECT_EQ(report.at("lights").at("count"), 1);
  EXPECT_EQ(report.at("lights").at("default_sky"), false);
  EXPECT_GT(report.at("rays").at("shade"), 1000);
}

TEST(Shading, FilesForAmbientOcclusionAreRefused) {
  const ShadedBench bench;
  ASSERT_EQ(run_packtrace({"bake", bench.scene(), "-o", bench.baked()}).exit_code, 0);
  const nlohmann::json info = nlohmann::json::parse(run_packtrace({"info", bench.baked(), "--json", "-"}).out);
  EXPECT_EQ(info.at("bytes").at("shading_materials"), 0);
  const CommandResult shaded = bench.render(bench.baked(), {"--view", "pbr"});
  EXPECT_EQ(shaded.exit_code, 4);
  EXPECT_NE(shaded.err.find("bake it again with --for shading"), std::string::npos) << shaded.err;
}

TEST(Shading, ScenesAndFilesGiveTheSamePicture) {
  const ShadedBench bench;
  ASSERT_EQ(run_packtrace({"bake", bench.scene(), "-o", bench.baked(), "--for", "shading"}).exit_code, 0);
  const std::vector<std::string> exr{"--view", "pbr", "-o", bench / "x.exr", "--no-jitter"};
  for (const char* backend : {"packed", "embree"}) {
    std::vector<std::string> options = exr;
    options.insert(options.end(), {"--backend", backend});
    ASSERT_EQ(bench.render(bench.baked(), options).exit_code, 0);
    const std::string name = bench / (std::string(backend) + ".exr");
    write_text(name, read_text(bench / "x.exr"));
  }
  ASSERT_EQ(bench.render(bench.scene(), exr).exit_code, 0);
  for (const char* other : {"packed.exr", "embree.exr"}) {
    const CommandResult compared =
        run_packtrace({"compare", bench / other, bench / "x.exr", "--layer", "pbr", "--json", "-"});
    ASSERT_EQ(compared.exit_code, 0) << compared.err;
    EXPECT_LT(nlohmann::json::parse(compared.out).at("metrics").at("mae"), 0.01) << other;
  }
}

TEST(Shading, PicturesDependOnExposureToneMapAndSettings) {
  const ShadedBench bench;
  const auto picture = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"--view", "pbr"});
    const CommandResult result = bench.render(bench.scene(), more);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return read_text(bench / "x.png");
  };
  const std::string plain = picture({});
  EXPECT_EQ(plain, picture({}));
  EXPECT_EQ(plain, picture({"--threads", "1"}));
  EXPECT_NE(plain, picture({"--exposure", "-2"}));
  EXPECT_NE(plain, picture({"--tone-map", "aces"}));
  EXPECT_NE(plain, picture({"--shade-set", "depth=0"}));
  EXPECT_NE(plain, picture({"--shade-set", "ambient=2", "--shade-set", "samples=2"}));
}

TEST(Shading, ScenesWithoutLightsSayWhatLightsThem) {
  const ShadedBench bench("");
  const CommandResult shaded = bench.render(bench.scene(), {"--view", "pbr"});
  EXPECT_EQ(shaded.exit_code, 0);
  EXPECT_NE(shaded.out.find("no lights: a white sky of radiance 0.6 lights it"), std::string::npos) << shaded.out;
}

TEST(Shading, SequencesAreShaded) {
  const ShadedBench bench;
  const CommandResult result = run_packtrace(
      {"render", bench.scene(), "-o", bench / "f_%d.png", "--path", "orbit:20", "--frames", "2", "--view", "pbr"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(read_text(bench / "f_0.png"), read_text(bench / "f_1.png"));
}

TEST(Shading, WrongOptionsAreRefused) {
  const ShadedBench bench;
  const auto message = [&](const std::vector<std::string>& options) {
    const CommandResult result = bench.render(bench.scene(), options);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    return result.err;
  };
  EXPECT_NE(message({"--view", "pbr", "--shade-set", "dept=2"}).find("did you mean depth?"), std::string::npos);
  EXPECT_NE(message({"--view", "pbr", "--shade-set", "depth=9"}).find("depth is 9, not in [0..8]"), std::string::npos);
  EXPECT_NE(message({"--exposure", "1"}).find("--exposure requires --view pbr or pbr+ao"), std::string::npos);
  EXPECT_NE(message({"--aov", "specular"}).find("require --view pbr or pbr+ao"), std::string::npos);
  message({"--view", "pbr", "--exposure", "99"});
  message({"--view", "shiny"});
  message({"--view", "pbr", "--tone-map", "filmic"});
}

} // namespace
} // namespace packtrace::test
