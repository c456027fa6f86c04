// Scenes at extremes of size, place and shape against the limits in tests/regression/limits.json; docs/accuracy.md
// sums up the results.

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <ostream>
#include <set>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "runtime/measure/stability.h"
#include "tests/sanitized.h"

namespace packtrace {

/// Names the case in messages of failures.
static void PrintTo(const StabilityCase& c, std::ostream* out) { *out << c.name; }

namespace test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const json& limits() {
  static const json all = [] {
    std::ifstream in(fs::path(PACKTRACE_SOURCE_DIR) / "tests/regression/limits.json");
    return json::parse(in).at("stability");
  }();
  return all;
}

std::string test_name(const std::string& name) {
  std::string result = name;
  std::ranges::replace_if(result, [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return result;
}

/// Writes the values for propose_limits.py if PACKTRACE_MEASURED names a folder.
void record(const std::string& name, const std::map<std::string, double>& metrics) {
  if (const char* const folder = std::getenv("PACKTRACE_MEASURED"))
    std::ofstream(fs::path(folder) / ("stability_" + test_name(name) + ".json"))
        << json{{"group", "stability"}, {"scene", name}, {"metrics", metrics}};
}

class Stability : public testing::TestWithParam<StabilityCase> {};

TEST_P(Stability, CaseKeepsItsLimits) {
  if (sanitized() && GetParam().name == "1,000 coinciding floors") GTEST_SKIP() << kOthersRunItsCode;
  const StabilityResult result = measure_stability(GetParam());
  const std::map<std::string, double> metrics{{"wrong_pixels", result.wrong_pixels},
                                              {"wrong_depths", result.wrong_depths},
                                              {"ao_mae", result.ao_mae},
                                              {"self_intersections", result.self_intersections},
                                              {"leaks", result.leaks}};
  record(result.name, metrics);
  ASSERT_TRUE(limits().contains(result.name)) << result.name << " has no entry in tests/regression/limits.json";
  const json& entry = limits().at(result.name);
  EXPECT_FALSE(entry.at("why").get<std::string>().empty());
  EXPECT_EQ(result.hits > 0, entry.at("visible").get<bool>());
  for (const auto& [name, value] : metrics)
    EXPECT_LE(value, entry.at("limits").at(name).get<double>()) << result.name << ": " << name;
}

std::string case_name(const testing::TestParamInfo<StabilityCase>& info) { return test_name(info.param.name); }

INSTANTIATE_TEST_SUITE_P(Cases, Stability, testing::ValuesIn(stability_cases()), case_name);

TEST(StabilityLimits, BelongToCases) {
  std::set<std::string> names;
  for (const StabilityCase& c : stability_cases()) names.insert(c.name);
  for (const auto& [name, entry] : limits().items()) EXPECT_TRUE(names.contains(name)) << name;
}

TEST(ExactDistance, IsThatOfThePlaneWithinTheTriangleAndInfiniteBeside) {
  const std::array<WorldTriangle, 1> triangle{{{{0, 0, 1}, {1, 0, 1}, {0, 1, 1}}}};
  EXPECT_DOUBLE_EQ(exact_distance({{0.25, 0.25, -1e9}, {0, 0, 1}}, triangle), 1e9 + 1.0);
  EXPECT_DOUBLE_EQ(exact_distance({{0.0, 0.5, 0.0}, {0, 0, 2}}, triangle), 0.5); // edges belong to it
  EXPECT_TRUE(std::isinf(exact_distance({{0.6, 0.6, 0.0}, {0, 0, 1}}, triangle)));
  EXPECT_TRUE(std::isinf(exact_distance({{0.25, 0.25, 0.0}, {0, 0, -1}}, triangle)));
  EXPECT_TRUE(std::isinf(exact_distance({{0.25, 0.25, 1.0}, {1, 0, 0}}, triangle))); // in its plane
}

} // namespace
} // namespace test
} // namespace packtrace
