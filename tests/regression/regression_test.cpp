// Measures whole scenes and compares with the limits in tests/regression/limits.json; docs/testing.md explains the
// metrics and how to propose new limits.
//
// Compiled twice: for the scenes in assets/ and, with PACKTRACE_SHARED_SCENES, for those in $PACKTRACE_SCENES.

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/regression/scene_metrics.h"
#include "tests/sanitized.h"

namespace packtrace::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

#ifdef PACKTRACE_SHARED_SCENES
constexpr const char* kGroup = "shared";
#else
constexpr const char* kGroup = "assets";
#endif

/// Folder of the scenes; empty if $PACKTRACE_SCENES is not set.
fs::path root() {
#ifdef PACKTRACE_SHARED_SCENES
  const char* const folder = std::getenv("PACKTRACE_SCENES");
  return folder ? folder : "";
#else
  return fs::path(PACKTRACE_SOURCE_DIR) / "assets";
#endif
}

const json& limits() {
  static const json all = [] {
    std::ifstream in(fs::path(PACKTRACE_SOURCE_DIR) / "tests/regression/limits.json");
    return json::parse(in);
  }();
  return all;
}

/// Scenes of the folder, relative to it: the files *.pbrt that hold a world. Files that others include have none.
std::vector<std::string> scenes_in(const fs::path& folder) {
  std::vector<std::string> result;
  std::error_code error;
  for (fs::recursive_directory_iterator it(folder, error), end; it != end && !error; it.increment(error)) {
    if (it->path().extension() != ".pbrt") continue;
    std::ifstream in(it->path());
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    if (text.find("WorldBegin") != std::string::npos) result.push_back(fs::relative(it->path(), folder).string());
  }
  std::ranges::sort(result);
  return result;
}

/// Scenes with limits, and those in the folder.
std::vector<std::string> scenes() {
  std::set<std::string> result;
  for (const auto& [name, limit] : limits().at(kGroup).items()) result.insert(name);
  if (!root().empty())
    for (const std::string& name : scenes_in(root())) result.insert(name);
  return {result.begin(), result.end()};
}

PictureSettings settings() {
  const json& picture = limits().at("picture");
  PictureSettings result{picture.at("width"), picture.at("height"), picture.at("spp"), picture.at("depth_tolerance")};
  if (sanitized()) result.spp = 4; // the same code; limits of occlusion are for the full number
  return result;
}

/// Writes the metrics for propose_limits.py if PACKTRACE_MEASURED names a folder.
void record(const std::string& scene, const Metrics& metrics) {
  const char* const folder = std::getenv("PACKTRACE_MEASURED");
  if (!folder) return;
  std::string name = std::string(kGroup) + "_" + scene + ".json";
  std::ranges::replace(name, '/', '_');
  std::ofstream(fs::path(folder) / name) << json{{"group", kGroup}, {"scene", scene}, {"metrics", metrics}};
}

class Regression : public testing::TestWithParam<std::string> {};

TEST_P(Regression, SceneKeepsItsLimits) {
  const std::string& scene = GetParam();
  if (sanitized() && (scene.starts_with("meadow/") || scene.starts_with("town/"))) GTEST_SKIP() << kOthersRunItsCode;
  if (root().empty()) GTEST_SKIP() << "PACKTRACE_SCENES is not set: " << scene << " is not tried";
  const fs::path file = root() / scene;
  if (!fs::exists(file) && std::string_view(kGroup) == "shared") GTEST_SKIP() << file << " is not there";
  ASSERT_TRUE(fs::exists(file)) << "limits.json has a scene that does not exist";
  const Metrics metrics = measure_scene(file, settings(), !sanitized());
  record(scene, metrics);
  ASSERT_TRUE(limits().at(kGroup).contains(scene))
      << "no entry in tests/regression/limits.json; tests/regression/propose_limits.py proposes one";
  const json& entry = limits().at(kGroup).at(scene);
  EXPECT_FALSE(entry.at("why").get<std::string>().empty());
  const json& limit = entry.at("limits");
  for (const auto& [name, value] : metrics) {
    if (sanitized() && name.find("_ao_") != std::string::npos) continue;
    ASSERT_TRUE(limit.contains(name)) << "no limit for " << name;
    const double bound = limit.at(name);
    if (name == "triangles" || name == "errors")
      EXPECT_EQ(value, bound) << scene << ": " << name;
    else
      EXPECT_LE(value, bound) << scene << ": " << name << " is " << value << ", its limit is " << bound << ", it was "
                              << entry.at("measured").value(name, 0.0) << " when the limit was set";
  }
}

std::string test_name(const testing::TestParamInfo<std::string>& info) {
  std::string name = info.param.substr(0, info.param.rfind('.'));
  std::ranges::replace_if(name, [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(Scenes, Regression, testing::ValuesIn(scenes()), test_name);

} // namespace
} // namespace packtrace::test
