// Runs the program on whole scenes and compares counts, sizes and image errors with tests/end_to_end/limits.json.

#include <cstdlib>
#include <filesystem>
#include <ostream>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/end_to_end/command.h"

namespace packtrace::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

json read_limits() { return json::parse(read_text(fs::path(PACKTRACE_SOURCE_DIR) / "tests/end_to_end/limits.json")); }

/// One scene of limits.json.
struct Case {
  std::string name; ///< path relative to its root folder
  fs::path file;
  bool external = false; ///< in the folder PACKTRACE_SCENES
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

std::vector<Case> cases() {
  std::vector<Case> result;
  const json limits = read_limits();
  const char* scenes = std::getenv("PACKTRACE_SCENES");
  for (const auto& [name, limit] : limits.at("scenes").items())
    result.push_back({name, fs::path(scenes ? scenes : "") / name, true});
  for (const auto& [name, limit] : limits.at("assets").items())
    result.push_back({name, fs::path(PACKTRACE_SOURCE_DIR) / "assets" / name, false});
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
    limits_ = all.at(GetParam().external ? "scenes" : "assets").at(GetParam().name);
    size_ = all.at("image").at("size");
    packed_against_float_ = all.at("packed_against_float");
    bake_ = run_packtrace(
        {"bake", GetParam().file.string(), "-o", directory_ / "scene.ptk", "--json", directory_ / "bake.json"});
    ASSERT_EQ(bake_.exit_code, 0) << bake_.err;
    report_ = json::parse(read_text(directory_ / "bake.json"));
  }

  void render(const std::string& input, const std::string& output, std::vector<std::string> more) const {
    std::vector<std::string> arguments = {"render", input, "-o", output, "--size", size_, "-q"};
    if (limits_.contains("camera")) arguments.insert(arguments.end(), {"--camera", limits_.at("camera")});
    arguments.insert(arguments.end(), more.begin(), more.end());
    const CommandResult result = run_packtrace(arguments);
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }

  CommandResult compare_ao(const std::string& a, const std::string& b, std::vector<std::string> limits) const {
    std::vector<std::string> arguments = {"compare", directory_ / a, directory_ / b, "--layer", "ao"};
    arguments.insert(arguments.end(), limits.begin(), limits.end());
    return run_packtrace(arguments);
  }

  TemporaryFolder directory_;
  json limits_, packed_against_float_, report_;
  std::string size_;
  CommandResult bake_;
};

TEST_P(WholeScene, HasTheReferenceCountsAndStaysSmall) {
  if (limits_.contains("triangles")) {
    uint64_t triangles = 0; // every triangle is either stored or counted as left out
    for (const char* kind : {"triangles", "collapsed_triangles", "coinciding_triangles"})
      triangles += report_.at(kind).get<uint64_t>();
    EXPECT_EQ(triangles, limits_.at("triangles").get<uint64_t>());
  }
  if (limits_.contains("errors")) {
    size_t errors = 0;
    for (size_t at = bake_.err.find(": error: "); at != std::string::npos; at = bake_.err.find(": error: ", at + 1))
      ++errors;
    EXPECT_EQ(errors, limits_.at("errors").get<size_t>()) << bake_.err;
  }
  EXPECT_LE(report_.at("bytes_per_triangle").get<double>(), limits_.at("max_bytes_per_triangle").get<double>());
  EXPECT_LE(report_.at("max_position_error").get<double>(), limits_.at("max_position_error").get<double>());
}

TEST_P(WholeScene, PackedOcclusionEqualsThatOfFloats) {
  const std::string spp = std::to_string(packed_against_float_.at("spp").get<int>());
  render(directory_ / "scene.ptk", directory_ / "packed.exr", {"--ground-truth", "--spp", spp});
  render(GetParam().file.string(), directory_ / "float.exr", {"--ground-truth", "--spp", spp});
  const CommandResult result =
      compare_ao("packed.exr", "float.exr",
                 {"--max-mae", packed_against_float_.at("max_mean_difference").dump(), "--max-mismatch", "0.001"});
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
}

TEST_P(WholeScene, ThirtyTwoDenoisedFramesComeCloseToTheTruth) {
  render(directory_ / "scene.ptk", directory_ / "denoised.exr", {"--frames", "32"});
  render(directory_ / "scene.ptk", directory_ / "truth.exr", {"--ground-truth"});
  const CommandResult result =
      compare_ao("denoised.exr", "truth.exr", {"--min-psnr", limits_.at("min_psnr_db").dump()});
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
}

INSTANTIATE_TEST_SUITE_P(Scenes, WholeScene, testing::ValuesIn(cases()), test_name);

} // namespace
} // namespace packtrace::test
