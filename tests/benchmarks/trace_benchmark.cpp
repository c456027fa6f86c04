// Traces the same recorded rays with every tracer, and with each of Embree's interfaces; documented in docs/tracing.md.

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <tbb/global_control.h>

#include "pbrt_import/base/error.h"
#include "runtime/trace/make_tracer.h"
#include "tests/benchmarks/benchmark_main.h"
#include "tests/benchmarks/benchmark_options.h"
#include "tests/benchmarks/packing_benchmark_machine.h"
#include "tests/benchmarks/trace_benchmark_counts.h"
#include "tests/benchmarks/trace_benchmark_inputs.h"
#include "tests/benchmarks/trace_benchmark_rays.h"
#include "tests/benchmarks/trace_benchmark_scales.h"
#include "tests/benchmarks/trace_benchmark_systems.h"

namespace packtrace {
namespace {

using Json = nlohmann::ordered_json;

struct Options {
  TraceInputOptions inputs;
  std::filesystem::path json_file;
  std::string camera = "0"; ///< camera number, or "auto"
  ImageSize size{960, 540};
  std::vector<uint32_t> threads{1, 2};
  uint32_t repeats = 5;
  bool cpu_clock = false;
  std::string embree_device; ///< configuration of rtcNewDevice()
  std::optional<double> max_mismatches;
  std::vector<double> scales;
  bool growth = false;
  std::vector<std::string> names;
};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0.0 : values[values.size() / 2];
}

/// Median ratio of the times of one phase, paired by repeat: both were measured at about the same moment.
double median_ratio(const std::vector<double>& reference, const std::vector<double>& seconds) {
  std::vector<double> ratios;
  for (size_t i = 0; i < seconds.size(); ++i) ratios.push_back(reference[i] / seconds[i]);
  return median(ratios);
}

/// Measures all rows in turn, filling their seconds and results.
void measure(Systems& systems, uint32_t threads, uint32_t repeats, bool cpu_clock) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  for (System& row : systems.rows) row.seconds.assign(row.rays->size(), {});
  for (uint32_t repeat = 0; repeat < repeats; ++repeat)
    for (size_t phase = 0; phase < systems.rows.front().rays->size(); ++phase)
      for (System& row : systems.rows) {
        // One untimed run first: otherwise only systems that follow another user of the same trees would find them in
        // cache.
        replay((*row.rays)[phase], *row.tracer, row.results[phase], cpu_clock);
        const double seconds = replay((*row.rays)[phase], *row.tracer, row.results[phase], cpu_clock);
        row.seconds[phase].push_back(cpu_clock ? seconds / threads : seconds);
      }
}

Json row_json(const TraceInput& input, const Systems& systems, const System& row, uint32_t threads) {
  Json json{{"system", row.name},
            {"call", row.call},
            {"isa", row.tracer->isa()},
            {"threads", threads},
            {"resident_bytes", resident_bytes(*row.tracer)},
            {"bytes_per_triangle",
             static_cast<double>(resident_bytes(*row.tracer)) / static_cast<double>(input.unique_triangles())},
            {"build_ms", row.build_ms}};
  const System& truth = systems.rows[systems.truth];
  const double t_scale = truth.tracer->space().scale() / row.tracer->space().scale();
  for (size_t phase = 0; phase < row.rays->size(); ++phase) {
    const RecordedRays& rays = (*row.rays)[phase];
    const System& reference = systems.rows[rays.order == RayOrder::kCoherent ? systems.packets : systems.single];
    const auto count = static_cast<double>(rays.count());
    json["phases"].push_back({{"phase", rays.name},
                              {"mrays_per_s", count / median(row.seconds[phase]) * 1e-6},
                              {"ratio", median_ratio(reference.seconds[phase], row.seconds[phase])},
                              {"mismatches", mismatches(rays, truth.results[phase], row.results[phase], t_scale)}});
  }
  return json;
}

void print_row(const Json& row) {
  fmt::print("| {} | {} |", row["system"].get<std::string>(), row["call"].get<std::string>());
  std::string wrong;
  for (const Json& phase : row["phases"]) {
    fmt::print(" {:.1f} ({:.2f}) |", phase["mrays_per_s"].get<double>(), phase["ratio"].get<double>());
    wrong += fmt::format("{}{}", wrong.empty() ? "" : " / ", phase["mismatches"].get<uint64_t>());
  }
  fmt::print(" {:.1f} | {:.0f} | {} |\n", row["bytes_per_triangle"].get<double>(), row["build_ms"].get<double>(),
             wrong);
}

/// Times the renderer's passes with each tracer that it can use.
Json measure_passes(const TraceInput& input, const Systems& systems, const PrimaryCamera& camera, float radius,
                    uint32_t threads, const Options& options) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  Json passes = Json::array();
  fmt::print("\nwhole passes of the renderer, Mrays/s:");
  for (const System& row : systems.rows) {
    if (row.call != kRayTracer) continue;
    const std::vector<double> seconds =
        time_passes(input.source, *row.tracer, camera, radius, options.repeats, options.cpu_clock);
    Json json{{"system", row.name}, {"threads", threads}};
    fmt::print(" {}", row.name);
    for (size_t phase = 0; phase < seconds.size(); ++phase) {
      const RecordedRays& rays = (*row.rays)[phase];
      const double elapsed = options.cpu_clock ? seconds[phase] / threads : seconds[phase];
      json["mrays_per_s"][std::string(rays.name)] = static_cast<double>(rays.count()) / elapsed * 1e-6;
      fmt::print(", {} {:.1f}", rays.name, static_cast<double>(rays.count()) / elapsed * 1e-6);
    }
    fmt::print(";");
    passes.push_back(std::move(json));
  }
  fmt::print("\n");
  std::fflush(stdout);
  return passes;
}

/// Whether every row has all phases and speeds.
bool complete(const Json& rows, size_t expected) {
  return rows.size() == expected && std::all_of(rows.begin(), rows.end(), [](const Json& row) {
           return row["phases"].size() == 3 && row["resident_bytes"].get<uint64_t>() > 0 &&
                  std::all_of(row["phases"].begin(), row["phases"].end(),
                              [](const Json& phase) { return phase["ratio"].get<double>() > 0.0; });
         });
}

void check_mismatches(const Json& rows, const Systems& systems, double most) {
  for (size_t i = 0; i < rows.size(); ++i) {
    const System& row = systems.rows[i % systems.rows.size()];
    for (size_t phase = 0; phase < row.rays->size(); ++phase) {
      const auto wrong = rows[i]["phases"][phase]["mismatches"].get<double>();
      if (row.watertight && wrong > most * static_cast<double>((*row.rays)[phase].count()))
        throw Error(ErrorKind::kLimitExceeded, fmt::format("{} {}: {} of {} rays differ in {}", row.name, row.call,
                                                           wrong, (*row.rays)[phase].count(), (*row.rays)[phase].name));
    }
  }
}

Json measure_input(const std::string& name, const Options& options) {
  const std::unique_ptr<TraceInput> input = load_trace_input(name, options.inputs);
  Systems systems = make_systems(*input, options.embree_device.c_str());
  const RayTracer& recorder = *systems.trees[systems.truth_trees];
  RecordedFrame recorded = record_frame(input->source, recorder, options.camera, options.size);
  const PrimaryCamera& camera = recorded.camera;
  const float radius = recorded.ao_radius;
  const auto frame = std::make_shared<const std::vector<RecordedRays>>(std::move(recorded.phases));
  for (System& row : systems.rows) {
    const bool same = row.tracer->space() == recorder.space();
    row.rays =
        same ? frame
             : std::make_shared<const std::vector<RecordedRays>>(moved(*frame, recorder.space(), row.tracer->space()));
  }

  Json json{{"name", input->name},
            {"unique_triangles", input->unique_triangles()},
            {"placed_triangles", input->placed_triangles()},
            {"instances", input->source.instances().size()},
            {"file_bytes", input->file.file_bytes()},
            {"ao_radius", radius}};
  fmt::print("\n## {}: {} triangles ({} placed), {} instances, AO radius {:.4g}\n", input->name,
             input->unique_triangles(), input->placed_triangles(), input->source.instances().size(), radius);
  for (const RecordedRays& phase : *frame) json["rays"][std::string(phase.name)] = phase.count();
  json["rows"] = Json::array();
  for (const uint32_t threads : options.threads) {
    measure(systems, threads, options.repeats, options.cpu_clock);
    fmt::print("\n{} thread{}; Mrays/s (ratio to Embree default: 16 for primary, 1 for ao)\n\n"
               "| system | call | primary | ao any | ao closest | B/tri | build ms | mismatches |\n"
               "|---|---|---|---|---|---|---|---|\n",
               threads, threads == 1 ? "" : "s");
    for (const System& row : systems.rows) {
      json["rows"].push_back(row_json(*input, systems, row, threads));
      print_row(json["rows"].back());
    }
    for (const System& row : systems.rows)
      if (row.name == "packed" && !json.contains("work")) json["work"] = count_work(*row.rays, *row.tracer);
    // The same for every number of threads.
    if (!json.contains("exact")) json["exact"] = compare_with_exact_hits(*input, systems);
    for (Json& pass : measure_passes(*input, systems, camera, radius, threads, options))
      json["passes"].push_back(std::move(pass));
  }
  if (!complete(json["rows"], systems.rows.size() * options.threads.size()))
    throw Error(ErrorKind::kLimitExceeded, input->name + ": figures are missing");
  if (options.max_mismatches) check_mismatches(json["rows"], systems, *options.max_mismatches);
  return json;
}

void add_options(BenchmarkOptions& command_line, Options& options) {
  command_line.add("--scenes", options.inputs.scenes, "holds house, spaceship, bunny and killeroo")
      .environment("PACKTRACE_SCENES");
  command_line.add("--mesh-triangles", options.inputs.mesh_triangles, "of the input mesh").show_default();
  command_line.add("--forest-instances", options.inputs.forest_instances, "of the input forest").show_default();
  command_line.add("--camera", options.camera, "which of the scene's, or auto; auto instead of one that sees nothing")
      .show_default();
  command_line.add("--width", options.size.width, "pixels").show_default();
  command_line.add("--height", options.size.height, "pixels").show_default();
  command_line.add("--threads", options.threads, "how many, one table each")
      .delimiter(',')
      .one_argument()
      .show_default();
  command_line.add("--repeats", options.repeats, "of which the median counts").show_default().range(1, 1000);
  command_line.flag(
      "--cpu-clock", options.cpu_clock,
      "CPU time of all threads divided by their number, not wall time: for machines that do other things");
  command_line.add("--embree-device", options.embree_device, "configuration of Embree's device, such as max_isa=avx2");
  command_line.add("--max-mismatches", options.max_mismatches,
                   "fail if watertight systems differ from Embree robust in more than this share of a phase's rays");
  command_line
      .add("--scales", options.scales,
           "instead: bakes the inputs (no .ptk files) at these scales and counts hits that are not those at 1")
      .delimiter(',')
      .one_argument()
      .range(1e-30, 1e30);
  command_line.flag("--growth", options.growth,
                    "instead: times the input mesh against one of a sixteenth of its triangles, one thread");
  command_line.add("--json", options.json_file, "writes all figures here");
  command_line.add(
      "INPUT", options.names,
      "house, spaceship, bunny, killeroo, town; mesh and forest, which are generated; .ptk and .pbrt files "
      "(default: the first five, or town where there is no folder of scenes)");
}

int run(int argc, char** argv) {
  Options options;
  BenchmarkOptions command_line{
      "Traces the same recorded rays with every tracer and in all ways of Embree; see docs/tracing.md."};
  add_options(command_line, options);
  if (const std::optional<int> code = command_line.parse(argc, argv)) return *code;
  if (options.names.empty()) {
    options.names = {"town"};
    if (!options.inputs.scenes.empty())
      options.names.insert(options.names.begin(), {"house", "spaceship", "bunny", "killeroo"});
  }
  FiguresFile figures(options.json_file);
  Json json = describe_machine();
  json["embree_device"] = options.embree_device;
  json["clock"] = options.cpu_clock ? "cpu" : "wall";
  if (options.growth)
    json["growth"] = measure_growth(options.inputs, options.camera, options.size, options.repeats, options.cpu_clock);
  for (const std::string& name : options.names) {
    if (options.growth) break;
    if (options.scales.empty())
      json["inputs"].push_back(measure_input(name, options));
    else
      json["scales"].push_back(measure_scales(name, options.inputs, options.camera, options.size, options.scales));
  }
  json["load_average_after"] = describe_machine()["load_average"];
  fmt::print("\n{}, load average {:.1f} before, {:.1f} after\n", json["cpu"].get<std::string>(),
             json["load_average"].get<double>(), json["load_average_after"].get<double>());
  figures.write(json);
  return 0;
}

} // namespace
} // namespace packtrace

int main(int argc, char** argv) { return packtrace::benchmark_main("trace_benchmark", packtrace::run, argc, argv); }
