// Measuring a scene, and baking by a measured target.

#include <filesystem>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <sys/resource.h>

#include "tests/end_to_end/measured_report.h"
#include "tests/sanitized.h"

namespace packtrace::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

CommandResult measure(const Workbench& bench, std::vector<std::string> more = {}) {
  std::vector<std::string> words{"measure", bench.scene(), "-o", bench / "report", "--quick", "--width",
                                 "32",      "--spp",       "4"};
  words.insert(words.end(), more.begin(), more.end());
  return run_packtrace(words);
}

} // namespace

MeasuredReport::MeasuredReport() {
  const std::vector<std::string> words{"measure", bench.scene(), "-o", bench / "report", "--quick", "--width",
                                       "16",      "--spp",       "1"};
  full = run_packtrace(words, [] { // room for the float pictures, not for a baked file
    const rlimit limit{2000, 2000};
    setrlimit(RLIMIT_FSIZE, &limit);
  });
  work_left = fs::exists(bench / "report/work");
  continued = run_packtrace(words);
}

const MeasuredReport& measured_report() {
  static const MeasuredReport report;
  return report;
}

namespace {

TEST(Measure, StopsAtAFullDiskAndContinues) {
  const MeasuredReport& report = measured_report();
  EXPECT_EQ(report.full.exit_code, 6) << report.full.err;
  EXPECT_NE(report.full.err.find("bake of point default failed"), std::string::npos) << report.full.err;
  EXPECT_NE(report.full.err.find("the same command continues"), std::string::npos) << report.full.err;
  EXPECT_FALSE(report.work_left);
  EXPECT_EQ(report.continued.exit_code, 0) << report.continued.err;
}

TEST(Measure, WritesAReportWithPictures) {
  const Workbench& bench = measured_report().bench;
  ASSERT_EQ(measured_report().continued.exit_code, 0);
  const Json report = Json::parse(read_text(bench / "report/report.json"));
  EXPECT_EQ(report["schema"], "packtrace-measure");
  EXPECT_EQ(report["schema_version"], 1);
  EXPECT_EQ(report["answers"].size(), 5u);
  EXPECT_FALSE(report["convergence"].empty());
  for (const Json& point : report["points"]) {
    if (point["status"] != "ok") continue;
    uint64_t sum = 0;
    for (const Json& stream : point["bytes"]["streams"]) sum += stream["bytes"].get<uint64_t>();
    EXPECT_EQ(sum, point["bytes"]["file"].get<uint64_t>()) << point["id"] << ": streams add up to the file";
    EXPECT_GT(point["peak_bytes"]["render"].get<uint64_t>(), 0u);
  }
  for (const Json& picture : report["pictures"])
    for (const char* key : {"float", "packed", "difference"})
      EXPECT_TRUE(fs::exists(bench / ("report/" + picture[key].get<std::string>())));
  for (const char* name : {"report.html", "report.csv"})
    EXPECT_TRUE(fs::exists(bench / (std::string("report/") + name)));
  EXPECT_FALSE(fs::exists(bench / "report/work")) << "baked files are removed";
}

TEST(Measure, ContinuesAndRefusesTheFolderOfAChangedScene) {
  if (sanitized()) GTEST_SKIP() << kOthersRunItsCode;
  const Workbench bench;
  ASSERT_EQ(measure(bench).exit_code, 0);
  const CommandResult again = measure(bench, {"--json", "-"});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  const Json counts = Json::parse(again.out)["counts"];
  EXPECT_EQ(counts["reused"], counts["ok"]);
  write_text(bench.scene(), small_scene_text() + "# changed\n");
  const CommandResult changed = measure(bench);
  EXPECT_EQ(changed.exit_code, 6) << changed.err;
  EXPECT_NE(changed.err.find("--force"), std::string::npos) << changed.err;
  EXPECT_EQ(measure(bench, {"--force"}).exit_code, 0);
}

TEST(Measure, DenoisesWithTheChosenPreset) {
  if (sanitized()) GTEST_SKIP() << kOthersRunItsCode;
  const Workbench bench;
  const auto errors = [&](const std::vector<std::string>& options) {
    const CommandResult result = measure(bench, options);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    std::vector<double> mae;
    const Json report = Json::parse(read_text(bench / "report/report.json"));
    for (const Json& entry : report["convergence"]) mae.push_back(entry["denoised"]["mae"]);
    return mae;
  };
  const std::vector<double> ours = errors({}), reference = errors({"--denoiser", "reference"});
  EXPECT_NE(ours, reference);
  EXPECT_EQ(errors({"--denoiser", "ours"}), ours) << "both remain in the folder";
  const CommandResult matrix = run_packtrace({"measure", bench.scene(), "--matrix", "--denoiser", "reference"});
  EXPECT_NE(matrix.out.find("--frames 8 --spp 1 --denoiser reference"), std::string::npos) << matrix.out;
  EXPECT_EQ(measure(bench, {"--denoiser", "off"}).exit_code, 2);
}

TEST(Measure, ListsItsPointsWithoutRunningThem) {
  const Workbench bench;
  const CommandResult result = run_packtrace({"measure", bench.scene(), "--matrix"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("bits-12"), std::string::npos);
  EXPECT_EQ(run_packtrace({"measure", bench.scene()}).exit_code, 2) << "no folder";
  EXPECT_EQ(run_packtrace({"measure", bench.scene(), "-o", bench.scene()}).exit_code, 6) << "a file";
}

/// A file of two worlds; the second one moves.
std::string two_worlds() {
  return "WorldBegin\n Shape \"sphere\"\nWorldEnd\n"
         "WorldBegin\n ActiveTransform EndTime\n Translate 0 0 50\n ActiveTransform All\n Shape \"sphere\" \"float "
         "radius\" 3\nWorldEnd\n";
}

TEST(Measure, EachCommandOfTheMatrixIsAccepted) {
  const Workbench bench;
  std::string text = small_scene_text(); // and something with levels
  write_text(bench.scene(), text.insert(text.find("WorldEnd"), "Shape \"sphere\"\n"));
  ASSERT_EQ(run_packtrace({"bake", bench.scene(), "-o", bench / "levels.ptk", "--lod", "-q"}).exit_code, 0);
  const CommandResult matrix = run_packtrace({"measure", bench.scene(), "--matrix"});
  std::istringstream lines(matrix.out);
  std::set<std::string> renders, bakes;
  for (std::string line; std::getline(lines, line);) {
    const size_t bake = line.find(" bake "), render = line.find("  render ");
    if (bake == std::string::npos || render == std::string::npos) continue;
    renders.insert(line.substr(render + 9));
    const bool once = line.find(" product ") == std::string::npos && line.find(" positions ") == std::string::npos;
    if (once) bakes.insert(line.substr(bake + 6, render - bake - 6));
  }
  ASSERT_GT(renders.size(), 8u);
  ASSERT_GT(bakes.size(), 8u);
  const auto accepted = [](std::vector<std::string> words, const std::string& options) {
    std::istringstream list(options);
    for (std::string word; list >> word;) words.push_back(word);
    const CommandResult result = run_packtrace(words);
    EXPECT_EQ(result.exit_code, 0) << options << "\n" << result.err;
  };
  for (const std::string& options : renders)
    accepted({"render", bench / "levels.ptk", "-o", bench / "a.png", "--force", "-q", "--size", "8x8"}, options);
  for (const std::string& options : bakes) accepted({"bake", bench.scene(), "--dry-run", "-q"}, options);
}

TEST(Measure, ComparesTheWorldAndTimeThatWereBaked) {
  const Workbench bench;
  write_text(bench.scene(), two_worlds());
  const std::vector<std::string> choice{"--world", "2", "--time", "1"};
  const auto run = [&](std::vector<std::string> words) {
    words.insert(words.end(), choice.begin(), choice.end());
    return run_packtrace(words);
  };
  ASSERT_EQ(run({"bake", bench.scene(), "-o", bench.baked()}).exit_code, 0);
  const CommandResult result = run({"compare", bench.baked(), bench.scene(), "--json", "-"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_LT(Json::parse(result.out)["distance"]["to_source"]["max"].get<double>(), 1e-3);
}

TEST(Target, WritesTheSmallestFileThatKeepsTheLimitOrNone) {
  if (sanitized()) GTEST_SKIP() << kOthersRunItsCode;
  const Workbench bench;
  const std::string out = bench / "a.ptk";
  const CommandResult found =
      run_packtrace({"bake", bench.scene(), "-o", out, "--target", "ao-error=0.01", "--json", "-"});
  ASSERT_EQ(found.exit_code, 0) << found.err;
  const Json target = Json::parse(found.out)["target"];
  const Json& chosen = target["tried"][target["chosen"].get<size_t>()];
  EXPECT_LE(chosen["ao"]["mae"].get<double>(), 0.01);
  EXPECT_EQ(chosen["bytes"]["file"].get<uint64_t>(), fs::file_size(out)) << "the measured file is the written one";
  for (const Json& tried : target["tried"])
    if (tried["ao"]["mae"].get<double>() <= 0.01) {
      EXPECT_GE(tried["bytes"]["file"], chosen["bytes"]["file"]);
    }
  const CommandResult none = run_packtrace({"bake", bench.scene(), "-o", bench / "b.ptk", "--target", "size=10"});
  EXPECT_EQ(none.exit_code, 5) << none.err;
  EXPECT_FALSE(fs::exists(bench / "b.ptk"));
  EXPECT_EQ(run_packtrace({"bake", bench.scene(), "-o", bench / "b.ptk", "--target", "speed=1"}).exit_code, 2);
}

TEST(Target, RefusesToLimitOcclusionThatThePicturesDoNotShow) {
  const Workbench bench;
  std::string text = small_scene_text();
  write_text(bench.scene(), text.erase(text.rfind("Shape"), text.rfind("WorldEnd") - text.rfind("Shape"))); // a floor
  const CommandResult result =
      run_packtrace({"bake", bench.scene(), "-o", bench / "a.ptk", "--target", "ao-error=0.01"});
  EXPECT_EQ(result.exit_code, 2) << result.err;
  EXPECT_NE(result.err.find("show no occlusion"), std::string::npos) << result.err;
  EXPECT_FALSE(fs::exists(bench / "a.ptk"));
}

TEST(Target, ComparesPicturesOfTheChosenCamera) {
  if (sanitized()) GTEST_SKIP() << kOthersRunItsCode;
  const Workbench bench;
  const auto bake = [&](const std::string& camera) {
    return run_packtrace({"bake", bench.scene(), "-o", bench / "a.ptk", "--force", "--position-bits", "12", "--target",
                          "ao-error=0.5", "--camera", camera, "--json", "-"});
  };
  const CommandResult automatic = bake("auto"), own = bake("0");
  ASSERT_EQ(automatic.exit_code, 0) << automatic.err;
  const Json target = Json::parse(automatic.out)["target"], target_0 = Json::parse(own.out)["target"];
  EXPECT_EQ(target["camera"]["frames_scene"], true);
  EXPECT_EQ(target_0["camera"]["index"], 0);
  EXPECT_NE(target["tried"][0]["ao"], target_0["tried"][0]["ao"]);
  EXPECT_NE(automatic.err.find("view of the whole scene"), std::string::npos) << automatic.err;
  EXPECT_EQ(bake("7").exit_code, 2) << "no such camera";
  EXPECT_EQ(run_packtrace({"bake", bench.scene(), "--dry-run", "--camera", "0"}).exit_code, 2) << "without --target";
}

TEST(Preset, OptionsOverrideIt) {
  const Workbench bench;
  const auto bake = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"bake", bench.scene(), "--dry-run", "--json", "-"});
    return Json::parse(run_packtrace(more).out);
  };
  EXPECT_EQ(bake({"--preset", "smallest"})["disk"]["codec"], "small");
  EXPECT_EQ(bake({"--preset", "smallest"})["trees"]["trees"], 0);
  EXPECT_EQ(bake({"--preset", "smallest", "--codec", "none"})["disk"]["codec"], "none");
  EXPECT_EQ(bake({"--preset", "exact"})["precision"]["value"], 24.0);
  EXPECT_EQ(bake({"--preset", "exact", "--position-bits", "9"})["precision"]["value"], 9.0);
  EXPECT_EQ(bake({"--preset", "balanced"})["disk"]["codec"], "fast");
}

TEST(Compare, MeasuresABakedFileAgainstItsScene) {
  const Workbench bench;
  bench.bake();
  const CommandResult result =
      run_packtrace({"compare", bench.baked(), bench.scene(), "--samples", "1000", "--json", "-"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(result.out);
  const CommandResult info = run_packtrace({"info", bench.baked(), "--json", "-"});
  const double bound = std::sqrt(3.0) * Json::parse(info.out)["max_position_error_bound"].get<double>() + 1e-12;
  EXPECT_LE(json["distance"]["to_packed"]["max"].get<double>(), bound);
  EXPECT_LE(json["distance"]["to_source"]["max"].get<double>(), bound);
  EXPECT_GE(json["distance"]["samples"].get<uint64_t>(), 1000u - 64u);
  EXPECT_EQ(json["missing_geometries"], 0);
  EXPECT_EQ(run_packtrace({"compare", bench.scene(), bench.baked()}).exit_code, 2) << "the wrong way round";
}

} // namespace
} // namespace packtrace::test
