// The parts of a measurement: matrix, fronts, histograms, image errors, folders and child processes.

#include <algorithm>
#include <csignal>
#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "pbrt_import/base/error.h"
#include "runtime/measure/answers.h"
#include "runtime/measure/ao_error.h"
#include "runtime/measure/child_process.h"
#include "runtime/measure/histogram.h"
#include "runtime/measure/matrix.h"
#include "runtime/measure/measure_folder.h"
#include "runtime/measure/pareto.h"
#include "runtime/measure/pictures.h"
#include "runtime/measure/point_runner.h"
#include "runtime/measure/report.h"
#include "tests/temporary_folder.h"

namespace packtrace {
namespace {

using Json = nlohmann::json;
constexpr std::array kModes{MatrixMode::kQuick, MatrixMode::kDefault, MatrixMode::kFull};

TEST(RenderWords, OtherTracersTakeTheOptionsOfPackedOnly) {
  RunnerConfig config;
  RenderKnobs knobs;
  const Words packed = render_words(knobs, config);
  config.tracer = {"--backend", "gpu", "--gpu-device", "llvm"};
  Words expected = packed;
  expected.insert(expected.end(), config.tracer.begin(), config.tracer.end());
  EXPECT_EQ(render_words(knobs, config), expected);
  knobs.backend = "embree";
  const Words embree = render_words(knobs, config);
  EXPECT_EQ(std::ranges::count(embree, "--gpu-device"), 0);
  EXPECT_EQ(std::ranges::count(embree, "--backend"), 1);
}

TEST(Matrix, PointsAreDistinctAndStartWithTheDefault) {
  size_t smaller = 0;
  for (const MatrixMode mode : kModes) {
    const std::vector<MeasurePoint> points = make_matrix(mode, {10.0, true}, 64);
    EXPECT_EQ(points.front().id, "default");
    EXPECT_TRUE(words_of(points.front().bake).empty());
    std::set<std::string> ids, commands;
    for (const MeasurePoint& point : points) {
      EXPECT_TRUE(ids.insert(point.id).second) << point.id;
      EXPECT_TRUE(
          commands.insert(shell_command(words_of(point.bake)) + "|" + shell_command(words_of(point.render))).second)
          << point.id;
      EXPECT_EQ(point.id.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.+"),
                std::string::npos)
          << point.id;
    }
    EXPECT_GT(points.size(), smaller) << "each mode measures more";
    smaller = points.size();
  }
}

TEST(Matrix, AFileIsBakedOnceForAllPointsThatTraceIt) {
  for (const MatrixMode mode : kModes) {
    const std::vector<MeasurePoint> points = make_matrix(mode, {10.0, true}, 64);
    std::vector<BakeKnobs> seen;
    for (const MeasurePoint& point : points) {
      if (!seen.empty() && seen.back() == point.bake) continue;
      EXPECT_EQ(std::count(seen.begin(), seen.end(), point.bake), 0) << point.id;
      seen.push_back(point.bake);
    }
  }
}

TEST(Matrix, SinglePointsDifferFromTheDefaultInOneFactor) {
  const std::vector<MeasurePoint> points = make_matrix(MatrixMode::kFull, {10.0, true}, 64);
  for (const MeasurePoint& point : points)
    if (point.group == "positions" || point.group == "normals" || point.group == "codec" || point.group == "trees") {
      EXPECT_EQ(words_of(point.bake).size(), 2u) << point.id;
    }
  EXPECT_GE(std::ranges::count(points, "positions", &MeasurePoint::group), 15) << "8..22 bits";
}

TEST(Matrix, HasWhatASearchForTheSmallestFileStartsFrom) {
  for (const MatrixMode mode : {MatrixMode::kDefault, MatrixMode::kFull})
    EXPECT_TRUE(std::ranges::any_of(make_matrix(mode, {10.0, true}, 64), [](const MeasurePoint& p) {
      return p.bake.grid == GridKind::kDefault && p.bake.codec == "small" && p.bake.trees == "off";
    }));
}

TEST(ShellCommand, QuotesWhatAShellWouldSplit) {
  EXPECT_EQ(shell_command({"packtrace", "bake", "my room.pbrt", "it's", ""}),
            "packtrace bake 'my room.pbrt' 'it'\\''s' ''");
}

TEST(Pareto, TheFrontHoldsWhatNothingDominates) {
  const std::vector<Costs> points{{1, 9}, {2, 5}, {3, 5}, {4, 1}, {2, 8}, {std::nan(""), 0}, {5, 2}};
  EXPECT_EQ(pareto_front(points), (std::vector<size_t>{0, 1, 3}));
  EXPECT_EQ(pareto_front(std::vector<Costs>{{1, 1}, {1, 1}}).size(), 2u) << "equal points do not dominate each other";
  EXPECT_TRUE(pareto_front({}).empty());
}

TEST(Pareto, TheKneeIsFarthestBelowTheLineBetweenTheEnds) {
  const std::vector<Costs> points{{1, 1000}, {10, 20}, {100, 10}, {1000, 1}};
  const std::vector<size_t> front = pareto_front(points);
  ASSERT_EQ(front.size(), 4u);
  EXPECT_EQ(knee_of(points, front), 1u);
  const std::vector<Costs> straight{{1, 100}, {10, 10}, {100, 1}};
  EXPECT_EQ(knee_of(straight, pareto_front(straight)), std::nullopt);
  EXPECT_EQ(knee_of(points, std::vector<size_t>{0, 3}), std::nullopt) << "two points have no knee";
  const std::vector<Costs> zero{{1, 9}, {2, 1}, {3, 0}};
  EXPECT_EQ(knee_of(zero, pareto_front(zero)), std::nullopt) << "no logarithm";
}

TEST(Histogram, EveryValueIsCountedOnce) {
  const std::vector<double> values{0.0, 1e-9, 0.5, 1.0, 3.0, 10.0};
  const Histogram h = make_histogram(values, "units");
  ASSERT_EQ(h.edges.size(), h.counts.size() + 1);
  EXPECT_TRUE(std::is_sorted(h.edges.begin(), h.edges.end()));
  EXPECT_EQ(std::accumulate(h.counts.begin(), h.counts.end(), uint64_t{0}), values.size());
  EXPECT_EQ(h.edges.back(), 10.0);
  EXPECT_EQ(h.counts.back(), 1u) << "the largest value is in the last bin";
  EXPECT_EQ(h.counts.front(), 2u) << "small values are in the first bin";
  EXPECT_EQ(make_histogram({0.0, 0.0}, "units").counts, std::vector<uint64_t>{2});
}

AoImage ao_image(std::vector<float> values, ImageSize size) {
  AoImage ao{Image(size, 1), {}};
  for (size_t i = 0; i < values.size(); ++i)
    ao.valid.push_back(values[i] >= 0.0f), ao.image.data[i] = std::max(0.0f, values[i]);
  return ao;
}

TEST(AoError, PixelsWithoutAValueAreCountedAndLeftOut) {
  const ImageSize size{4, 1};
  const Json error = ao_error(ao_image({0.5f, 1.0f, -1.0f, -1.0f}, size), ao_image({0.25f, 1.0f, 0.5f, -1.0f}, size));
  EXPECT_EQ(error["compared_pixels"], 2);
  EXPECT_EQ(error["mismatched_pixels"], 1);
  EXPECT_DOUBLE_EQ(error["mae"].get<double>(), 0.125);
  EXPECT_DOUBLE_EQ(error["p99"].get<double>(), 0.25);
  EXPECT_TRUE(error["ssim"].is_null()) << "smaller than its window";
  EXPECT_TRUE(ao_error(ao_image({-1, -1, -1, -1}, size), ao_image({1, 1, 1, 1}, size))["mae"].is_null());
  EXPECT_THROW(ao_error(ao_image({1}, {1, 1}), ao_image({1, 1}, {2, 1})), Error);
}

TEST(AoError, TheWorstTilesComeFirst) {
  std::vector<float> errors(6 * 3, 0.0f);
  errors[2 * 6 + 5] = 1.0f, errors[0] = 0.5f; // the corner tile has 1 x 1 pixels of 2 x 2
  const std::vector<ErrorTile> tiles = worst_tiles(errors, {6, 3}, 2, 10);
  ASSERT_EQ(tiles.size(), 2u) << "tiles without an error are left out";
  EXPECT_EQ(tiles[0].x, 4u);
  EXPECT_EQ(tiles[0].height, 1u);
  EXPECT_DOUBLE_EQ(tiles[0].max, 1.0);
  EXPECT_DOUBLE_EQ(tiles[0].mae, 0.5);
  EXPECT_EQ(worst_tiles(errors, {6, 3}, 2, 1).size(), 1u);
}

TEST(MeasureFolder, ContinuesItsOwnAndRefusesOthers) {
  const TemporaryFolder temporary;
  const Json mine{{"scene", "a"}, {"version", "1"}}, other{{"scene", "b"}, {"version", "1"}};
  {
    const MeasureFolder folder(temporary / "report", mine, false);
    folder.save("x", {{"id", "x"}});
  }
  EXPECT_EQ(MeasureFolder(temporary / "report", mine, false).load("x").value()["id"], "x");
  EXPECT_FALSE(MeasureFolder(temporary / "report", mine, false).load("y"));
  EXPECT_THROW(MeasureFolder(temporary / "report", other, false), Error);
  EXPECT_FALSE(MeasureFolder(temporary / "report", other, true).load("x")) << "--force starts anew";
  write_text_file(temporary / "file", "text");
  EXPECT_THROW(MeasureFolder(temporary / "file", mine, true), Error);
  EXPECT_THROW(MeasureFolder(temporary.path(), mine, true), Error) << "other content is never removed";
}

TEST(MeasureFolder, ADamagedPartIsMeasuredAgain) {
  const TemporaryFolder temporary;
  const MeasureFolder folder(temporary / "report", {{"scene", "a"}}, false);
  write_text_file(folder / "points/x.json", "{\"id\": ");
  EXPECT_FALSE(folder.load("x"));
}

TEST(MeasureFolder, TheStateOfFilesChangesWithThem) {
  const TemporaryFolder temporary;
  const std::vector<std::filesystem::path> files{temporary / "a", temporary / "missing"};
  write_text_file(files[0], "text");
  const std::string before = state_of(files);
  EXPECT_EQ(state_of(files), before);
  write_text_file(files[0], "longer text");
  EXPECT_NE(state_of(files), before);
  EXPECT_NE(key_of("a"), key_of("b"));
  EXPECT_EQ(key_of("a").size(), 16u);
}

TEST(ChildProcess, ReportsExitCodesSignalsAndErrors) {
  EXPECT_TRUE(run_child({"-c", "exit 0"}, "/bin/sh").ok());
  const ChildResult failed = run_child({"-c", "echo gone >&2; exit 3"}, "/bin/sh");
  EXPECT_EQ(failed.exit_code, 3);
  EXPECT_EQ(failed.error, "gone");
  EXPECT_GT(failed.peak_bytes, 0u);
  const ChildResult killed = run_child({"-c", "kill -KILL $$"}, "/bin/sh");
  EXPECT_EQ(killed.signal, SIGKILL);
  EXPECT_FALSE(killed.ok());
  EXPECT_LT(run_child({"-c", "yes | head -c 1000000 >&2"}, "/bin/sh").error.size(), 5000u) << "only the end is kept";
}

Json point_json(const char* id, const char* status, double bytes, double mae) {
  return {{"id", id},
          {"group", id == std::string("default") ? "default" : "positions"},
          {"status", status},
          {"reused", false},
          {"knobs",
           {{"positions", {{"kind", "default"}, {"value", nullptr}}},
            {"spp", 64},
            {"frames", 1},
            {"denoise", false},
            {"lod", "off"},
            {"lod_error_px", nullptr},
            {"backend", "packed"},
            {"ao_resolution", "full"}}},
          {"bytes", {{"file", bytes}}},
          {"ao", {{"mae", mae}}},
          {"label", "a \"b\", c"},
          {"commands", {{"bake", "x, y"}, {"render", "z"}}}};
}

TEST(Report, FlagsDominatedPointsAndCountsFailures) {
  Json points{point_json("default", "ok", 100, 0.1), point_json("worse", "ok", 200, 0.2),
              point_json("gone", "killed", 1, 0.0)};
  const Json fronts = add_fronts(points, 64);
  EXPECT_EQ(fronts[0]["ids"], Json::array({"default"}));
  EXPECT_EQ(points[0]["flags"]["dominated"], false);
  EXPECT_EQ(points[1]["flags"]["dominated"], true);
  EXPECT_TRUE(points[2]["flags"]["dominated"].is_null());
  EXPECT_EQ(counts_of(points)["failed"], 1);
  const std::string csv = csv_of(points);
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 4);
  EXPECT_NE(csv.find("\"x, y\",z\n"), std::string::npos) << csv;
}

/// A report with what the answers need; both float pictures are equal if `noise` is 0.
Json report_json(double error, double noise) {
  Json point = point_json("default", "ok", 100, error);
  point["ao"]["noise_ratio"] = noise > 0.0 ? Json(error / noise) : Json();
  point["bytes"]["streams"] = Json::array({Json{{"name", "positions"}, {"bytes", 100}}});
  return {{"settings", {{"spp", 64}}},    {"points", Json::array({point})},
          {"default_id", "default"},      {"tiles", Json::array()},
          {"convergence", Json::array()}, {"reference", {{"noise_floor", {{"mae", noise}}}}}};
}

TEST(Answers, NoiseIsComparedOnlyIfThereIsSome) {
  const auto fourth = [](double error, double noise) {
    return answer_questions(report_json(error, noise), 0.005)[3]["text"].get<std::string>();
  };
  EXPECT_TRUE(fourth(0.01, 0.02).starts_with("No: the default's mean AO error of 0.01 is 0.5 times"))
      << fourth(0.01, 0.02);
  EXPECT_TRUE(fourth(0.04, 0.02).starts_with("Yes: the default's mean AO error of 0.04 is 2 times"));
  EXPECT_TRUE(fourth(0.01, 0.0).starts_with("Yes: the default's mean AO error is 0.01, and there is no noise"))
      << fourth(0.01, 0.0);
  const auto first = [](double noise) {
    return answer_questions(report_json(0.0, noise), 0.005)[0]["text"].get<std::string>();
  };
  EXPECT_NE(first(0.0).find("show no occlusion"), std::string::npos) << first(0.0);
  EXPECT_EQ(first(0.02).find("show no occlusion"), std::string::npos);
  EXPECT_TRUE(fourth(0.0, 0.0).starts_with("No: the default has no AO error. There is no noise")) << fourth(0.0, 0.0);
}

TEST(Pictures, TilesNameTheGeometryAtTheirWorstPixelThatShowsOne) {
  const TemporaryFolder temporary;
  const MeasureFolder folder(temporary / "report", {{"scene", "a"}}, false);
  const ImageSize size{4, 2}; // tiles of 2 x 2 pixels
  const AoImage floats = ao_image({-1.0f, 0.5f, -1.0f, -1.0f, 0.5f, 0.5f, -1.0f, -1.0f}, size);
  const AoImage packed =
      ao_image({0.5f, 0.75f, 0.5f, -1.0f, 0.5f, 0.5f, -1.0f, -1.0f}, size); // hits in two more pixels
  const std::vector<uint32_t> instances{~0u, 1, ~0u, ~0u, 0, 0, ~0u, ~0u};
  const Json tiles =
      write_pictures({{"default", "default", packed}}, floats, instances, {"floor", "wall"}, 2, folder)["tiles"];
  ASSERT_EQ(tiles.size(), 2u);
  EXPECT_EQ(tiles[0]["geometry"], "wall");
  EXPECT_TRUE(tiles[1]["geometry"].is_null()) << "the float picture shows nothing there";
}

} // namespace
} // namespace packtrace
