#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <tbb/global_control.h>

#include "pbrt_import/base/error.h"
#include "tests/benchmarks/benchmark_main.h"
#include "tests/benchmarks/benchmark_options.h"
#include "tests/benchmarks/packing_benchmark_codecs.h"
#include "tests/benchmarks/packing_benchmark_cracks.h"
#include "tests/benchmarks/packing_benchmark_machine.h"
#include "tests/benchmarks/packing_benchmark_mesh.h"
#include "tests/benchmarks/thread_cpu_time.h"

namespace packtrace {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr int kZstdLevel = 19;
constexpr double kEdgeFraction = 1.0 / 128.0;
constexpr double kPositionCodes = (1 << 14) - 1;

struct Options {
  PackingInputs inputs;
  fs::path json_file;
  double seconds = 0.5;
  std::string codec; ///< part of the names of the codecs to measure
};

/// Minimum CPU time of a call in this thread, over repeated calls until `budget_s` is used up; at least one call.
template <typename Call>
double least_seconds(double budget_s, const Call& call) {
  double least = std::numeric_limits<double>::infinity(), total = 0.0;
  do {
    const double start = thread_cpu_seconds();
    call();
    const double seconds = thread_cpu_seconds() - start;
    least = std::min(least, seconds);
    total += seconds;
  } while (total < budget_s);
  return least;
}

template <typename Value>
Json or_null(const std::optional<Value>& value) {
  return value ? Json(*value) : Json();
}

Json measure(PackingCodec& codec, const Mesh& mesh, const PackingPrecision& precision, double budget_s) {
  const double triangles = static_cast<double>(mesh.triangles.size());
  const auto mtri_per_s = [&](double seconds) { return triangles / seconds * 1e-6; };
  size_t bytes = 0;
  const double encode_s = least_seconds(budget_s, [&] { bytes = codec.encode(mesh, precision); });
  Json json{{"codec", codec.name()},
            {"precision", codec.rounds() ? Json(precision.name) : Json()},
            {"step", codec.rounds() ? Json(precision.step) : Json()},
            {"bytes", bytes},
            {"bytes_per_triangle", static_cast<double>(bytes) / triangles},
            {"encode_mtri_per_s", mtri_per_s(encode_s)}};
  const double open_s = codec.has_open() ? least_seconds(budget_s, [&] { codec.open(); }) : 0.0;
  if (codec.has_open()) json["open_mtri_per_s"] = mtri_per_s(open_s);
  const double decode_s = least_seconds(budget_s, [&] { codec.decode(); });
  json["decode_mtri_per_s"] = mtri_per_s(decode_s);
  json["open_and_decode_mtri_per_s"] = mtri_per_s(open_s + decode_s);
  const PackingErrors errors = codec.errors(mesh, precision);
  json["errors"] = {{"position", errors.position},
                    {"position_in_steps", errors.position / precision.step},
                    {"normal_max_degrees", or_null(errors.normal_max_degrees)},
                    {"normal_mean_degrees", or_null(errors.normal_mean_degrees)},
                    {"uv", or_null(errors.uv)},
                    {"lost_triangles", errors.lost_triangles}};
  return json;
}

std::string degrees(const Json& errors) {
  if (errors["normal_max_degrees"].is_null()) return "-";
  return fmt::format("{:.4f} / {:.3f}", errors["normal_mean_degrees"].get<double>(),
                     errors["normal_max_degrees"].get<double>());
}

void print_head(const std::string& what) {
  fmt::print("\n{}\n\n"
             "| codec | error asked | B/triangle | encode, Mtri/s | decode, Mtri/s | largest position error, steps "
             "| normals, degrees mean / max | uv error | triangles lost |\n"
             "|---|---|---|---|---|---|---|---|---|\n",
             what);
}

void print_row(const Json& row) {
  const Json& errors = row["errors"];
  std::string decode = fmt::format("{:.1f}", row["decode_mtri_per_s"].get<double>());
  if (row.contains("open_mtri_per_s")) decode += fmt::format(" (open {:.1f})", row["open_mtri_per_s"].get<double>());
  fmt::print("| {} | {} | {:.2f} | {:.2f} | {} | {} | {} | {} | {} |\n", row["codec"].get<std::string>(),
             row["precision"].is_null() ? "exact" : row["precision"].get<std::string>(),
             row["bytes_per_triangle"].get<double>(), row["encode_mtri_per_s"].get<double>(), decode,
             row["precision"].is_null() ? "0" : fmt::format("{:.3f}", errors["position_in_steps"].get<double>()),
             degrees(errors), errors["uv"].is_null() ? "-" : fmt::format("{:.1e}", errors["uv"].get<double>()),
             errors["lost_triangles"].get<uint64_t>());
  std::fflush(stdout);
}

Json measure_streams(const Mesh& mesh, PackedStreams streams, const std::vector<PackingPrecision>& precisions,
                     const Options& options) {
  std::vector<std::unique_ptr<PackingCodec>> codecs;
  codecs.push_back(raw_codec());
  codecs.push_back(fixed_vertex_codec(0));
  codecs.push_back(fixed_vertex_codec(kZstdLevel));
  codecs.push_back(meshopt_codec(kZstdLevel));
  codecs.push_back(draco_codec());
  for (const PageCodec codec : {PageCodec::kNone, PageCodec::kFast, PageCodec::kSmall}) {
    codecs.push_back(packtrace_codec({codec, false, false}));
    if (streams == PackedStreams::kPositions) codecs.push_back(packtrace_codec({codec, false, true}));
    if (streams == PackedStreams::kAll && !mesh.uvs.empty()) codecs.push_back(packtrace_codec({codec, true, false}));
  }
  Json rows = Json::array();
  for (const PackingPrecision& precision : precisions)
    for (const auto& codec : codecs) {
      if (!codec->rounds() && &precision != &precisions.front()) continue;
      if (codec->name().find(options.codec) == std::string::npos) continue;
      rows.push_back(measure(*codec, mesh, precision, options.seconds));
      print_row(rows.back());
    }
  return rows;
}

Json measure_cracks(const Scene& scene) {
  const CrackCounts c = count_cracks(scene, {});
  fmt::print("\nCracks, all shapes of the world as they are, default precision: {} triangles; {} positions in several "
             "clusters, {} cracked; {} in several meshes, {} cracked ({} if each mesh had a 16-bit box of its own); {} "
             "triangles lost; left out: {} without area on the grid, {} equal to others there, {} instanced shapes\n",
             c.triangles, c.shared_between_clusters, c.cracked_between_clusters, c.shared_between_meshes,
             c.cracked_between_meshes, c.own_box_cracked_between_meshes, c.lost_triangles, c.collapsed_triangles,
             c.coinciding_triangles, c.instanced_shapes);
  return {{"triangles", c.triangles},
          {"instanced_shapes", c.instanced_shapes},
          {"shared_between_clusters", c.shared_between_clusters},
          {"cracked_between_clusters", c.cracked_between_clusters},
          {"shared_between_meshes", c.shared_between_meshes},
          {"cracked_between_meshes", c.cracked_between_meshes},
          {"own_box_cracked_between_meshes", c.own_box_cracked_between_meshes},
          {"lost_triangles", c.lost_triangles},
          {"collapsed_triangles", c.collapsed_triangles},
          {"coinciding_triangles", c.coinciding_triangles}};
}

Json measure_input(const PackingInput& input, const Options& options) {
  const double edge = median_edge(input.mesh);
  const std::vector<PackingPrecision> precisions = {{"p14", packing_box(input.mesh).side / kPositionCodes},
                                                    {"edge/128", edge * kEdgeFraction}};
  const Mesh welded = weld_positions(input.mesh);
  fmt::print("\n## {}: {} triangles, {} vertices ({} places)\n\np14: a step of {:.2g} median edges\n", input.name,
             input.mesh.triangles.size(), input.mesh.positions.size(), welded.positions.size(),
             precisions[0].step / edge);
  Json json{{"name", input.name},
            {"triangles", input.mesh.triangles.size()},
            {"vertices", input.mesh.positions.size()},
            {"places", welded.positions.size()},
            {"median_edge", edge}};
  print_head("Positions and topology:");
  json["positions"] = measure_streams(welded, PackedStreams::kPositions, precisions, options);
  print_head(input.mesh.uvs.empty() ? "With normals:" : "With normals and texture coordinates:");
  json["all"] = measure_streams(input.mesh, PackedStreams::kAll, precisions, options);
  json["cracks"] = measure_cracks(input.scene);
  return json;
}

int run(int argc, char** argv) {
  Options options;
  BenchmarkOptions command_line{
      "Packs meshes with this project and with others, for the same error; see docs/packing_benchmark.md."};
  options.inputs.add_to(command_line);
  command_line.add("--seconds", options.seconds, "of CPU time for the repeats of each step; the least counts")
      .not_negative()
      .show_default();
  command_line.add("--codec", options.codec, "only codecs with this in their names");
  command_line.add("--json", options.json_file, "writes all figures here");
  if (const std::optional<int> code = command_line.parse(argc, argv)) return *code;
  options.inputs.choose();
  FiguresFile figures(options.json_file);

  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  Json json = describe_machine();
  fmt::print("{}, load average {:.1f}; commit {}; CPU time of one thread\n", json["cpu"].get<std::string>(),
             json["load_average"].get<double>(), json["commit"].get<std::string>());
  for (const std::string& name : options.inputs.names)
    json["inputs"].push_back(measure_input(options.inputs.find(name), options));
  figures.write(json);
  const bool closed = std::all_of(json["inputs"].begin(), json["inputs"].end(),
                                  [](const Json& input) { return input["cracks"]["lost_triangles"] == 0; });
  return closed ? 0 : static_cast<int>(ErrorKind::kLimitExceeded);
}

} // namespace
} // namespace packtrace

int main(int argc, char** argv) { return packtrace::benchmark_main("packing_benchmark", packtrace::run, argc, argv); }
