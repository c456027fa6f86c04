// Runs the program on whole scenes and compares denoised pictures with the limits in tests/regression/limits.json.

#include <cstdlib>
#include <filesystem>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/end_to_end/command.h"

namespace packtrace::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

json read_limits() { return json::parse(read_text(fs::path(PACKTRACE_SOURCE_DIR) / "tests/regression/limits.json")); }

/// A scene of limits.json that has a limit for denoised pictures.
struct Case {
  std::string name; ///< path relative to its root folder
  fs::path file;
  bool external = false; ///< in the folder PACKTRACE_SCENES
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

std::vector<Case> cases() {
  std::vector<Case> result;
  const json limits = read_limits();
  const char* shared = std::getenv("PACKTRACE_SCENES");
  for (const auto& [group, root] :
       {std::pair("shared", fs::path(shared ? shared : "")), {"assets", fs::path(PACKTRACE_SOURCE_DIR) / "assets"}})
    for (const auto& [name, entry] : limits.at(group).items())
      if (entry.contains("denoised")) result.push_back({name, root / name, group == std::string_view("shared")});
  return result;
}

std::string test_name(const testing::TestParamInfo<Case>& info) {
  std::string name = info.param.name.substr(0, info.param.name.find('/'));
  return name;
}

class WholeScene : public testing::TestWithParam<Case> {
protected:
  void SetUp() override {
    if (GetParam().external && !std::getenv("PACKTRACE_SCENES"))
      GTEST_SKIP() << "PACKTRACE_SCENES is not set: " << GetParam().name << " is not tried";
    const json all = read_limits();
    limits_ = all.at(GetParam().external ? "shared" : "assets").at(GetParam().name).at("denoised");
    picture_ = all.at("denoised_picture");
    const CommandResult bake = run_packtrace({"bake", GetParam().file.string(), "-o", directory_ / "scene.ptk", "-q"});
    ASSERT_EQ(bake.exit_code, 0) << bake.err;
  }

  void render(const std::string& input, const std::string& output, std::vector<std::string> more) const {
    std::vector<std::string> arguments = {"render", input, "-o", output, "--size", picture_.at("size"), "-q"};
    if (limits_.contains("camera")) arguments.insert(arguments.end(), {"--camera", limits_.at("camera")});
    arguments.insert(arguments.end(), more.begin(), more.end());
    const CommandResult result = run_packtrace(arguments);
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }

  /// Few frames suffice where the picture differs from the truth by far more than its noise; noise only lowers the
  /// PSNR.
  void render_truth(std::vector<std::string> more) const {
    const json& frames = limits_.contains("truth_frames") ? limits_.at("truth_frames") : picture_.at("truth_frames");
    more.insert(more.end(), {"--ground-truth", "--frames", frames.dump()});
    render(directory_ / "scene.ptk", directory_ / "truth.exr", std::move(more));
  }

  CommandResult compare_ao(const std::string& a, const std::string& b, std::vector<std::string> limits) const {
    std::vector<std::string> arguments = {"compare", directory_ / a, directory_ / b, "--layer", "ao"};
    arguments.insert(arguments.end(), limits.begin(), limits.end());
    return run_packtrace(arguments);
  }

  TemporaryFolder directory_;
  json limits_, picture_;
};

TEST_P(WholeScene, DenoisedFramesComeCloseToTheTruth) {
  render(directory_ / "scene.ptk", directory_ / "denoised.exr",
         {"--no-jitter", "--frames", picture_.at("frames").dump()});
  render_truth({"--no-jitter"});
  const CommandResult result =
      compare_ao("denoised.exr", "truth.exr", {"--min-psnr", limits_.at("min_psnr_db").dump()});
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
}

/// The picture that users get without options, against one that is smooth and without noise.
TEST_P(WholeScene, DefaultPicturesAreSmooth) {
  render(directory_ / "scene.ptk", directory_ / "default.exr", {});
  render_truth({});
  const CommandResult result =
      compare_ao("default.exr", "truth.exr", {"--min-psnr", limits_.at("min_smooth_psnr_db").dump()});
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
}

INSTANTIATE_TEST_SUITE_P(Scenes, WholeScene, testing::ValuesIn(cases()), test_name);

} // namespace
} // namespace packtrace::test
