#include "runtime/measure/measure.h"

#include <algorithm>
#include <array>
#include <ctime>
#include <fstream>
#include <iterator>

#include <fmt/format.h>

#include "runtime/image/exr.h"
#include "runtime/image/metrics.h"
#include "runtime/measure/answers.h"
#include "runtime/measure/html_report.h"
#include "runtime/measure/pictures.h"
#include "runtime/measure/report.h"
#include "runtime/measure/stability.h"
#include "runtime/stopwatch.h"

namespace packtrace {
namespace {

using Json = nlohmann::json;
constexpr uint32_t kTilePx = 32;

std::string utc_now() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text.data();
}

std::string file_bytes(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

Json settings_of(const MeasureConfig& config, const Json& reference) {
  constexpr std::array<const char*, 3> kModes{"quick", "default", "full"};
  const RunnerConfig& runner = config.runner;
  return {{"mode", kModes[static_cast<size_t>(config.mode)]},
          {"width", runner.size.width},
          {"height", runner.size.height},
          {"camera", reference.at("camera")},
          {"ao_radius", reference.at("ao_radius")},
          {"spp", runner.spp},
          {"seed", runner.seed},
          {"noise_seed", runner.noise_seed},
          {"distance_samples", runner.distance_samples},
          {"flip_pixels_per_degree", kFlipPixelsPerDegree},
          {"tile_px", kTilePx},
          {"max_error", config.max_error},
          {"embree_beside_each_point", runner.embree_beside_each_point}};
}

/// The default and the point of fewest bits, which shows where bits are lost.
std::vector<PicturedPoint> pictured_points(const std::vector<MeasurePoint>& matrix, const Json& points,
                                           const PointRunner& runner, const MeasureFolder& folder) {
  std::vector<PicturedPoint> pictured;
  const auto add = [&](size_t i) {
    if (i < matrix.size() && points[i].at("status") == "ok")
      pictured.push_back({matrix[i].id, matrix[i].label, read_ao(folder.image(runner.key(matrix[i])))});
  };
  const auto first = [&](auto... groups) {
    const auto found =
        std::ranges::find_if(matrix, [&](const MeasurePoint& p) { return ((p.group == groups) || ...); });
    return static_cast<size_t>(found - matrix.begin());
  };
  add(first("default"));
  // 10 bits if measured: at 8, little is left of most scenes
  const auto ten = std::ranges::find(matrix, "bits-10", &MeasurePoint::id);
  add(ten == matrix.end() ? first("positions") : static_cast<size_t>(ten - matrix.begin()));
  add(first("normals"));
  return pictured;
}

/// How the program does at extremes of size, place and shape; does not depend on the scene.
Json stability_table() {
  Json table = Json::array();
  for (const StabilityCase& stability_case : stability_cases())
    table.push_back(to_json(measure_stability(stability_case)));
  return table;
}

void write_report(const MeasureFolder& folder, const Json& report) {
  write_json(folder / "report.json", report);
  write_text_file(folder / "report.csv", csv_of(report.at("points")));
  write_html_report(report, folder.path(), folder / "report.html");
}

} // namespace

nlohmann::json run_measure(const MeasureConfig& config, Progress& progress) {
  const Stopwatch clock;
  const std::string started = utc_now();
  const MeasureFolder folder(
      config.output,
      {{"scene", config.runner.scene}, {"version", config.version}, {"state", key_of(config.runner.identity)}},
      config.force);
  const std::vector<MeasurePoint> matrix = make_matrix(config.mode, config.matrix_scene, config.runner.spp);
  const std::vector<uint32_t> frames = convergence_frames(config.mode);
  PointRunner runner(config.runner, folder);
  const auto unmeasured = std::ranges::count_if(matrix, [&](const MeasurePoint& p) { return !runner.is_measured(p); });
  // Points of earlier runs take no time, so the estimate of the time left excludes them.
  progress.begin("measuring", static_cast<uint64_t>(unmeasured) + 3);
  Json report{{"schema", "packtrace-measure"},
              {"schema_version", 1},
              {"program", {{"name", "packtrace"}, {"version", config.version}}},
              {"command", config.command},
              {"started", started},
              {"machine", config.machine},
              {"scene", config.scene},
              {"default_id", matrix.front().id}};
  report["reference"] = runner.make_reference();
  report["settings"] = settings_of(config, report["reference"]);
  for (const char* setting : {"camera", "ao_radius"}) report["reference"].erase(setting);
  progress.advance();
  Json points = Json::array();
  for (const MeasurePoint& point : matrix) {
    points.push_back(runner.measure(point));
    if (!points.back().at("reused")) progress.advance();
    if (point.group == "default") {
      report["convergence"] = runner.convergence(point.bake, frames);
      progress.advance();
      report["resolution"] = runner.resolution(point.bake, resolution_samples(config.mode));
      progress.advance();
    }
  }
  report["fronts"] = add_fronts(points, config.runner.spp);
  report["lod"] = lod_curve(points);
  report["counts"] = counts_of(points);
  report["stability"] = config.mode == MatrixMode::kQuick ? Json::array() : stability_table();
  if (points[0].contains("isa")) report["machine"]["isa"] = points[0].at("isa");
  const std::string reference = file_bytes(runner.reference_file());
  const Json shown = write_pictures(pictured_points(matrix, points, runner, folder), runner.reference(),
                                    decode_exr_uint(std::as_bytes(std::span(reference)), "float.exr", "instance"),
                                    config.instance_names, kTilePx, folder);
  report["pictures"] = shown.at("pictures"), report["tiles"] = shown.at("tiles");
  report["points"] = std::move(points);
  report["answers"] = answer_questions(report, config.max_error);
  report["seconds"] = clock.seconds();
  write_report(folder, report);
  return report;
}

} // namespace packtrace
