// Times import_scene() on the inputs of docs/import_speed.md.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <thread>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pbrt_import/base/error.h"
#include "tests/benchmarks/benchmark_main.h"
#include "tests/benchmarks/benchmark_options.h"
#include "tests/benchmarks/import_timing.h"
#include "tests/temporary_folder.h"

namespace packtrace {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct Options {
  fs::path folder, json_file, scenes;
  uint32_t repeats = 7;
  double scale = 1;
  bool growth = false;
  std::vector<std::string> inputs;
};

/// Reference figures for the full size from another machine, and the targets for this importer.
struct Anchor {
  std::string_view input;
  double parser_cpu_ms, parser_rss_mib; ///< the fastest public parser
  double reference_cpu_ms, reference_rss_mib;
  double target_cpu_ms;        ///< on the reference machine
  double target_rss_mib;       ///< the parser's figure unless another target is stated
  double target_scan_multiple; ///< speed relative to the from_chars scan; 0: no target
  double target_wall_ratio;    ///< wall time with one thread relative to two; 0: no target
};
constexpr double kAnchorScanMultiple = 0.65; ///< speed of the fastest public parser relative to the scan, on `meshes`
constexpr double kAnchorScanMbPerS = 199 / 0.446 / kAnchorScanMultiple;
constexpr std::array kAnchors{
    Anchor{"meshes", 446, 94, 1963, 905, 446 / 1.5, 94, 1.5 * kAnchorScanMultiple, 1.8},
    Anchor{"one-mesh", 534, 168, 2183, 1263, 534 / 1.5, 168, 1.5 * kAnchorScanMultiple, 1.8},
    Anchor{"instances", 175, 36, 565, 175, 70, 18, 0, 0},
    Anchor{"ply", 76, 52, 633, 395, 76 / 1.5, 52, 0, 1.8},
    Anchor{"objects", 846, 23, 234, 88, 60, 23, 0, 0},
    Anchor{"materials", 920, 37, 191, 61, 60, 37, 0, 0},
    Anchor{"includes", 97, 14, 36, 14, 20, 14, 0, 0},
};

/// Spread of repeated measurements.
struct Spread {
  double min = 0, median = 0, max = 0;
};
Spread spread(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return {values.front(), values[values.size() / 2], values.back()};
}
Json to_json(const Spread& s) { return {{"min", s.min}, {"median", s.median}, {"max", s.max}}; }

template <class T>
Spread spread(const std::vector<T>& measurements, double T::* member) {
  std::vector<double> values;
  for (const T& measurement : measurements) values.push_back(measurement.*member);
  return spread(std::move(values));
}

struct InputFigures {
  struct Import {
    Spread cpu_ms, wall_ms, peak_rss_mib;
  };
  std::array<Import, 2> threads; ///< with one and two threads
  Spread copy_ms, scan_ms, scan_wall_ms, two_thread_scan_wall_ms;

  double wall_ratio() const { return threads[0].wall_ms.min / threads[1].wall_ms.min; }
  double scan_wall_ratio() const { return scan_wall_ms.min / two_thread_scan_wall_ms.min; }
  /// CPU-time speed relative to the scan; for PLY files, which have no scan, relative to the copy.
  double calibration_multiple(bool binary) const { return (binary ? copy_ms : scan_ms).min / threads[0].cpu_ms.min; }
};

/// Interleaves the measurements, so that changes of the machine's speed affect all of them.
InputFigures measure(const ImportInput& input, uint32_t repeats) {
  std::array<std::vector<ImportTiming>, 2> timings;
  std::vector<Calibration> calibrations;
  for (uint32_t i = 0; i < repeats; ++i) {
    calibrations.push_back(calibrate(input));
    for (uint32_t t = 0; t < timings.size(); ++t) timings[t].push_back(time_import(input, t + 1));
  }
  InputFigures f;
  for (size_t t = 0; t < timings.size(); ++t) {
    f.threads[t] = {spread(timings[t], &ImportTiming::cpu_ms), spread(timings[t], &ImportTiming::wall_ms),
                    spread(timings[t], &ImportTiming::peak_rss_mib)};
  }
  f.copy_ms = spread(calibrations, &Calibration::copy_ms);
  f.scan_ms = spread(calibrations, &Calibration::scan_ms);
  f.scan_wall_ms = spread(calibrations, &Calibration::scan_wall_ms);
  f.two_thread_scan_wall_ms = spread(calibrations, &Calibration::two_thread_scan_wall_ms);
  return f;
}

double mb_per_s(uint64_t bytes, double ms) { return static_cast<double>(bytes) * 1e-3 / ms; }

Json describe(const ImportInput& input, const InputFigures& f) {
  Json json{
      {"input", input.name}, {"file", input.main_file.string()}, {"bytes", input.bytes}, {"threads", Json::array()}};
  if (input.triangles) json["triangles"] = *input.triangles;
  if (input.instances) json["instances"] = *input.instances;
  for (size_t t = 0; t < f.threads.size(); ++t) {
    const InputFigures::Import& figure = f.threads[t];
    json["threads"].push_back({{"count", t + 1},
                               {"cpu_ms", to_json(figure.cpu_ms)},
                               {"wall_ms", to_json(figure.wall_ms)},
                               {"peak_rss_mib", figure.peak_rss_mib.max},
                               {"mb_per_cpu_s", mb_per_s(input.bytes, figure.cpu_ms.min)},
                               {"mb_per_wall_s", mb_per_s(input.bytes, figure.wall_ms.min)}});
  }
  json["wall_ratio"] = f.wall_ratio();
  json["calibration"] = {{input.binary ? "read_and_copy_ms" : "copy_ms", to_json(f.copy_ms)},
                         {"copy_gb_per_s", mb_per_s(input.bytes, f.copy_ms.min) * 1e-3}};
  if (!input.binary) {
    json["calibration"]["scan_ms"] = to_json(f.scan_ms);
    json["calibration"]["scan_mb_per_s"] = mb_per_s(input.bytes, f.scan_ms.min);
    json["calibration"]["scan_wall_ratio"] = f.scan_wall_ratio();
  }
  json["calibration"]["import_speed_multiple"] = f.calibration_multiple(input.binary);
  return json;
}

/// Returns the anchor, the figures and which targets hold.
Json judge(const Anchor& anchor, const ImportInput& input, const InputFigures& f) {
  Json targets = Json::array();
  const auto at_most = [&](const char* what, double value, double limit) {
    targets.push_back({{"what", what}, {"value", value}, {"at_most", limit}, {"holds", value <= limit}});
  };
  const auto at_least = [&](const char* what, double value, double limit) {
    if (limit > 0)
      targets.push_back({{"what", what}, {"value", value}, {"at_least", limit}, {"holds", value >= limit}});
  };
  at_most("cpu_ms", f.threads[0].cpu_ms.min, anchor.target_cpu_ms);
  at_most("peak_rss_mib", f.threads[0].peak_rss_mib.max, anchor.target_rss_mib);
  at_least("scan_multiple", f.calibration_multiple(input.binary), anchor.target_scan_multiple);
  at_least("wall_ratio", f.wall_ratio(), anchor.target_wall_ratio);
  return {{"fastest_public_parser", {{"cpu_ms", anchor.parser_cpu_ms}, {"peak_rss_mib", anchor.parser_rss_mib}}},
          {"reference", {{"cpu_ms", anchor.reference_cpu_ms}, {"peak_rss_mib", anchor.reference_rss_mib}}},
          {"targets", targets}};
}

void print_anchor(const Json& anchor) {
  for (const char* who : {"fastest_public_parser", "reference"})
    fmt::print("  anchor       {:21} CPU {:5.0f} ms   peak RSS {:.0f} MiB   (another machine)\n", who,
               anchor[who]["cpu_ms"].get<double>(), anchor[who]["peak_rss_mib"].get<double>());
  for (const Json& target : anchor["targets"]) {
    const bool most = target.contains("at_most");
    fmt::print("  target       {:13} {} {:7.2f}: {:7.2f} {}\n", target["what"].get<std::string>(),
               most ? "<=" : ">=", target[most ? "at_most" : "at_least"].get<double>(), target["value"].get<double>(),
               target["holds"].get<bool>() ? "holds" : "MISSED");
  }
}

void print(const Json& result) {
  fmt::print("\n{}: {:.1f} MB", result["input"].get<std::string>(), result["bytes"].get<double>() * 1e-6);
  for (const char* count : {"triangles", "instances"})
    if (result.value(count, 0) > 0) fmt::print(", {} {}", result[count].get<uint64_t>(), count);
  fmt::print("\n");
  for (const Json& t : result["threads"]) {
    fmt::print(
        "  threads {}    CPU {:5.0f} ms (median {:5.0f})   wall {:5.0f} ms (median {:5.0f})   {:4.0f} MB/s wall   "
        "peak RSS {:.0f} MiB\n",
        t["count"].get<int>(), t["cpu_ms"]["min"].get<double>(), t["cpu_ms"]["median"].get<double>(),
        t["wall_ms"]["min"].get<double>(), t["wall_ms"]["median"].get<double>(), t["mb_per_wall_s"].get<double>(),
        t["peak_rss_mib"].get<double>());
  }
  const Json& calibration = result["calibration"];
  const bool text = calibration.contains("scan_ms");
  fmt::print("  calibration  {} {:.1f} GB/s", text ? "memcpy" : "read and memcpy",
             calibration["copy_gb_per_s"].get<double>());
  if (text)
    fmt::print(", from_chars scan {:.0f} MB/s, {:.2f} times faster on 2 threads",
               calibration["scan_mb_per_s"].get<double>(), calibration["scan_wall_ratio"].get<double>());
  fmt::print(
      "\n  import       {:.2f} times the speed of that {} (CPU, 1 thread), {:.2f} times faster on 2 threads (wall)\n",
      calibration["import_speed_multiple"].get<double>(), text ? "scan" : "copy", result["wall_ratio"].get<double>());
  if (result.contains("anchor")) print_anchor(result["anchor"]);
  std::fflush(stdout);
}

/// Returns the exponent b of CPU time = a * size^b, by least squares over the logarithms.
double exponent(const std::vector<std::pair<double, double>>& size_and_ms) {
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  const double n = static_cast<double>(size_and_ms.size());
  for (const auto& [size, ms] : size_and_ms) {
    const double x = std::log(size), y = std::log(ms);
    sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

Json measure_growth(const Options& options) {
  Json results = Json::array();
  fmt::print("\ngrowth of CPU time with size, one thread\n");
  for (const char* name : {"meshes", "instances", "objects", "materials", "includes"}) {
    constexpr std::array kFractions{0.25, 0.5, 1.0};
    std::array<ImportInput, kFractions.size()> inputs;
    std::array<std::vector<double>, kFractions.size()> cpu_ms;
    for (size_t i = 0; i < inputs.size(); ++i)
      inputs[i] = make_input(name, options.folder, kFractions[i] * options.scale);
    for (uint32_t repeat = 0; repeat < options.repeats; ++repeat)
      for (size_t i = 0; i < inputs.size(); ++i) cpu_ms[i].push_back(time_import(inputs[i], 1).cpu_ms);
    std::vector<std::pair<double, double>> points;
    Json steps = Json::array();
    for (size_t i = 0; i < inputs.size(); ++i) {
      points.emplace_back(kFractions[i], spread(cpu_ms[i]).min);
      steps.push_back(
          {{"fraction", kFractions[i]}, {"bytes", inputs[i].bytes}, {"cpu_ms", to_json(spread(cpu_ms[i]))}});
    }
    results.push_back({{"input", name}, {"exponent", exponent(points)}, {"steps", steps}});
    fmt::print("  {:10} 1/4: {:5.1f} ms   1/2: {:5.1f} ms   1: {:5.1f} ms   exponent {:.2f}\n", name, points[0].second,
               points[1].second, points[2].second, exponent(points));
  }
  return results;
}

std::string cpu_model() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);)
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  return "unknown";
}

/// Commit of the source tree if it is a checkout.
std::string commit() {
  std::string text;
  if (std::FILE* pipe = ::popen("git -C " PACKTRACE_SOURCE_DIR " describe --always --dirty 2>/dev/null", "r")) {
    for (int c; (c = std::fgetc(pipe)) != EOF && c != '\n';) text += static_cast<char>(c);
    ::pclose(pipe);
  }
  return text.empty() ? "unknown" : text;
}

ImportInput find_input(const std::string& name, const Options& options) {
  const fs::path house = options.scenes / "house" / "scene.pbrt";
  if (name == "ply" && options.scale == 1 && fs::exists(house)) return existing_scene(name, house);
  return make_input(name, options.folder, options.scale);
}

Json measure_all(const Options& options) {
  double load = 0;
  getloadavg(&load, 1);
  Json json{{"cpu", cpu_model()},         {"hardware_threads", std::thread::hardware_concurrency()},
            {"load_average", load},       {"commit", commit()},
            {"repeats", options.repeats}, {"scale", options.scale},
            {"results", Json::array()}};
  fmt::print("{}, {} hardware threads, load average {:.1f}; commit {}; least of {}\n", json["cpu"].get<std::string>(),
             json["hardware_threads"].get<uint32_t>(), load, json["commit"].get<std::string>(), options.repeats);
  for (const std::string& name : options.inputs) {
    const ImportInput input = find_input(name, options);
    const InputFigures f = measure(input, options.repeats);
    Json result = describe(input, f);
    const auto anchor =
        std::find_if(kAnchors.begin(), kAnchors.end(), [&](const Anchor& a) { return a.input == name; });
    if (options.scale == 1 && anchor != kAnchors.end()) result["anchor"] = judge(*anchor, input, f);
    print(result);
    if (name == "meshes" && options.scale == 1) {
      json["speed_of_anchor_machine"] = mb_per_s(input.bytes, f.scan_ms.min) / kAnchorScanMbPerS;
      fmt::print("  this machine's from_chars scan runs at {:.2f} of the anchor machine's speed\n",
                 json["speed_of_anchor_machine"].get<double>());
    }
    json["results"].push_back(std::move(result));
  }
  if (options.growth) json["growth"] = measure_growth(options);
  return json;
}

int run(int argc, char** argv) {
  Options options;
  BenchmarkOptions command_line{"Times the import of generated pbrt-v3 scenes; see docs/import_speed.md."};
  command_line.add("--folder", options.folder, "keeps the inputs here and finds them again; else a temporary folder");
  command_line.add("--repeats", options.repeats, "imports of each kind").positive().show_default();
  command_line.add("--json", options.json_file, "writes all figures here");
  command_line.add("--scenes", options.scenes, "holds house/scene.pbrt, which is then imported as `ply`")
      .environment("PACKTRACE_SCENES");
  command_line.add("--scale", options.scale, "of the counts, in (0, 1]; anchors are shown for 1 only").show_default();
  command_line.flag("--growth", options.growth, "also measures 1/4, 1/2 and all of the size");
  command_line.add("INPUT", options.inputs, "which; all if none is named")
      .one_of(std::vector<std::string>(input_names().begin(), input_names().end()));
  if (const std::optional<int> code = command_line.parse(argc, argv)) return *code;
  if (options.inputs.empty()) options.inputs.assign(input_names().begin(), input_names().end());
  std::optional<TemporaryFolder> temporary;
  if (options.folder.empty()) options.folder = temporary.emplace().path();
  FiguresFile figures(options.json_file);
  const Json json = measure_all(options);
  figures.write(json);
  return 0;
}

} // namespace
} // namespace packtrace

int main(int argc, char** argv) { return packtrace::benchmark_main("import_benchmark", packtrace::run, argc, argv); }
