#include "runtime/measure/target.h"

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

using Json = nlohmann::json;

/// A scene whose error halves and whose size grows with every bit.
Json synthetic(const BakeKnobs& knobs) {
  const double bits = knobs.grid == GridKind::kBits ? knobs.grid_value : 20.0;
  const bool coarse = knobs.normals == "axis16";
  const double degrees = coarse ? 0.5 : knobs.normals == "axis32" ? 0.001 : knobs.normal_error.value_or(0.04);
  return {{"status", "ok"},
          {"bytes", {{"file", 1000.0 * bits - (coarse ? 300.0 : 0.0)}}},
          {"ao", {{"mae", std::exp2(-bits) + (coarse ? 1e-4 : 0.0)}}},
          {"position", {{"max", std::exp2(-bits)}, {"rms", std::exp2(-bits)}}},
          {"normal", {{"max_degrees", degrees}}}};
}

TargetResult search(const std::vector<std::string>& targets) {
  TargetSearch search;
  for (const std::string& target : targets) search.targets.push_back(parse_target(target));
  return search_target(search, synthetic);
}

const BakeKnobs& chosen(const TargetResult& result) { return result.knobs[result.best.value()]; }

TEST(Target, ParsesNamesNumbersAndUnits) {
  EXPECT_EQ(parse_target("ao-error=0.002").kind, TargetKind::kAoError);
  EXPECT_EQ(parse_target("ao-error=2e-3").limit, 0.002);
  EXPECT_EQ(parse_target("size=3MB").limit, 3e6);
  EXPECT_EQ(parse_target("size=1.5MiB").limit, 1.5 * 1048576);
  EXPECT_EQ(parse_target("size=100").limit, 100.0);
  for (const char* bad : {"", "size", "size=", "size=-3MB", "size=0", "size=3Mb", "size=nan", "ao-error=inf",
                          "ao-error=1MB", "ao-eror=1", "=1", "normal-error=x", "size=1e999"})
    EXPECT_THROW(parse_target(bad), Error) << bad;
}

TEST(Target, FindsTheFewestBitsThatKeepAnError) {
  const TargetResult result = search({"position-error=0.001"});
  EXPECT_EQ(chosen(result).grid_value, 10.0) << "2^-10 < 0.001 < 2^-9";
  EXPECT_LE(result.tried.size(), 10u) << "bisection";
}

TEST(Target, CoarserNormalsAreTakenWhereTheyKeepTheLimit) {
  EXPECT_EQ(chosen(search({"ao-error=0.01"})).normals, "axis16");
  EXPECT_EQ(chosen(search({"ao-error=1.01e-4"})).normals, "auto") << "coarse normals alone add 1e-4";
}

TEST(Target, FindsTheFinestPositionsWithinASize) {
  const TargetResult result = search({"size=12.5kB"});
  EXPECT_EQ(chosen(result).grid_value, 12.0);
}

TEST(Target, AllLimitsHoldTogether) {
  EXPECT_TRUE(search({"position-error=0.001", "size=12kB"}).best);
  EXPECT_FALSE(search({"position-error=0.001", "size=9kB"}).best);
  const TargetResult both = search({"position-error=0.001", "normal-error=0.01"});
  EXPECT_EQ(chosen(both).normal_error, 0.01);
}

TEST(Target, NormalsAloneLeavePositionsAsTheyAre) {
  EXPECT_EQ(chosen(search({"normal-error=0.1"})).grid, GridKind::kDefault);
  EXPECT_EQ(chosen(search({"normal-error=0.002"})).normals, "axis32");
}

TEST(Target, AnUnreachableLimitChoosesNothing) {
  EXPECT_FALSE(search({"ao-error=1e-12"}).best);
  EXPECT_FALSE(search({"size=1kB"}).best);
}

TEST(Target, FailedPointsKeepNoLimit) {
  TargetSearch failing;
  failing.targets.push_back(parse_target("ao-error=1"));
  const TargetResult result = search_target(failing, [](const BakeKnobs&) { return Json{{"status", "killed"}}; });
  EXPECT_FALSE(result.best);
  EXPECT_NE(to_text(result, failing.targets).find("killed"), std::string::npos);
}

TEST(Target, GivenOptionsAreNotChanged) {
  TargetSearch fixed;
  fixed.targets.push_back(parse_target("ao-error=0.01"));
  fixed.free_grid = false, fixed.base.grid = GridKind::kBits, fixed.base.grid_value = 16;
  const TargetResult result = search_target(fixed, synthetic);
  EXPECT_EQ(chosen(result).grid_value, 16.0);
  EXPECT_EQ(result.tried.size(), 1u);
}

} // namespace
} // namespace packtrace
