#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <sys/utsname.h>

#include "compress/bake/grid/scene_measure.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/scene/separate_motion.h"
#include "runtime/commands/cli/cli_support.h"
#include "runtime/commands/cli/json_output.h"
#include "runtime/commands/cli/loaded_scene.h"
#include "runtime/commands/cli/option_checks.h"
#include "runtime/commands/cli/progress_display.h"
#include "runtime/commands/cli/whole_number.h"
#include "runtime/commands/commands.h"
#include "runtime/commands/compare/geometry_compare.h"
#include "runtime/measure/measure.h"
#include "runtime/trace/source/float_source.h"

namespace packtrace {
namespace {

struct MeasureOptions {
  std::string input, output;
  bool quick = false, full = false, matrix = false;
  std::optional<uint32_t> spp, width;
  std::optional<std::string> camera;
  double max_error = 0.005;
  std::string denoiser = "ours";
  std::string backend = "packed";
  std::optional<std::string> gpu_device;
  SceneOptions scene;

  MatrixMode mode() const { return quick ? MatrixMode::kQuick : full ? MatrixMode::kFull : MatrixMode::kDefault; }
};

/// Size of the pictures: the aspect ratio of the camera, or 16:9 if the whole scene is framed.
/// @param longer length of the longer side, pixels
ImageSize picture_size(const Scene& scene, const std::optional<std::string>& camera, uint32_t longer) {
  const std::optional<uint32_t> index = whole_number(camera.value_or("0"));
  const bool known = index && *index < scene.cameras.size();
  const double w = known ? scene.cameras[*index].width_px : 16.0, h = known ? scene.cameras[*index].height_px : 9.0;
  const auto side = [&](double length) {
    return std::max(1u, static_cast<uint32_t>(std::lround(longer * length / std::max(w, h))));
  };
  return {side(w), side(h)};
}

std::string cpu_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.starts_with("model name")) return line.substr(std::min(line.find(": ") + 2, line.size()));
  return "unknown";
}

nlohmann::json machine_json(const GlobalOptions& globals) {
  utsname system{};
  uname(&system);
  const uint32_t hardware = std::max(1u, std::thread::hardware_concurrency()), limit = thread_limit(globals);
  return {{"cpu", cpu_name()},
          {"hardware_threads", hardware},
          {"threads", limit > 0 ? limit : hardware},
          {"memory_bytes", machine_memory()},
          {"system", fmt::format("{} {} {}", system.sysname, system.release, system.machine)},
          {"isa", nullptr}};
}

uint64_t float_bytes(const Scene& scene) {
  uint64_t bytes = 0;
  for (const Mesh& mesh : scene.meshes) bytes += bytes_of(mesh);
  return bytes;
}

nlohmann::json scene_json(const MeasureOptions& options, const ImportResult& imported, const FloatSource& source) {
  const Scene& scene = imported.scene;
  const Bounds bounds = source.world_bounds();
  uint64_t bytes = 0;
  for (const std::filesystem::path& file : imported.files) {
    std::error_code missing;
    const uint64_t size = std::filesystem::file_size(file, missing);
    if (!missing) bytes += size;
  }
  Progress unseen;
  const double median_edge = measure_scene(scene, plan_scene(scene), unseen).world.median_edge;
  const auto array = [](DVec3 v) { return std::array{v.x, v.y, v.z}; };
  return {{"path", options.input},
          {"name", std::filesystem::absolute(options.input).parent_path().filename().string() + "/" +
                       std::filesystem::path(options.input).stem().string()},
          {"triangles", unique_triangle_count(scene)},
          {"placed_triangles", placed_triangle_count(scene)},
          {"geometries", source.geometry_count()},
          {"instances", source.instances().size()},
          {"materials", scene.materials.size()},
          {"cameras", scene.cameras.size()},
          {"files", imported.statistics.files_read},
          {"file_bytes", bytes},
          {"float_bytes", float_bytes(scene)},
          {"diagonal", bounds.diagonal()},
          {"bounds", {{"lo", array(bounds.lo + source.origin())}, {"hi", array(bounds.hi + source.origin())}}},
          {"median_edge", median_edge > 0.0 ? nlohmann::json(median_edge) : nullptr}};
}

/// Name of the geometry of each instance, numbered like SceneSource::instances().
std::vector<std::string> instance_names(const Scene& scene) {
  std::vector<std::string> names;
  for (const Shape& shape : scene.shapes) names.push_back(scene.meshes[shape.mesh].name);
  for (const Instance& instance : scene.instances) names.push_back(scene.objects[instance.object].name);
  return names;
}

Words common_words(const GlobalOptions& globals) {
  Words words{"--max-memory", std::to_string(globals.memory.limit())};
  if (globals.threads > 0) words.insert(words.end(), {"--threads", std::to_string(globals.threads)});
  return words;
}

/// Options of render for the tracer of packed files.
Words tracer_words(const MeasureOptions& options) {
  if (options.gpu_device && !options.backend.starts_with("gpu"))
    throw Error(ErrorKind::kUsage, "--gpu-device requires --backend gpu or gpu-rt");
  Words words;
  if (options.backend != MeasureOptions().backend) words.insert(words.end(), {"--backend", options.backend});
  if (options.gpu_device) words.insert(words.end(), {"--gpu-device", *options.gpu_device});
  return words;
}

std::string measure_command_text(const MeasureOptions& options) {
  Words words{"packtrace", "measure", options.input, "-o", options.output};
  if (options.quick) words.emplace_back("--quick");
  if (options.full) words.emplace_back("--full");
  if (options.spp) words.insert(words.end(), {"--spp", std::to_string(*options.spp)});
  if (options.width) words.insert(words.end(), {"--width", std::to_string(*options.width)});
  if (options.camera) words.insert(words.end(), {"--camera", *options.camera});
  if (options.denoiser != MeasureOptions().denoiser) words.insert(words.end(), {"--denoiser", options.denoiser});
  for (const std::string& word : tracer_words(options)) words.push_back(word);
  for (const std::string& word : scene_words(options.scene)) words.push_back(word);
  return shell_command(words);
}

MeasureConfig config_of(const MeasureOptions& options, const GlobalOptions& globals, const std::string& version,
                        const ImportResult& imported) {
  const FloatSource source(imported.scene);
  const auto mode = static_cast<size_t>(options.mode());
  MeasureConfig config;
  config.mode = options.mode();
  config.matrix_scene.diagonal = source.world_bounds().diagonal();
  config.matrix_scene.has_uvs =
      std::ranges::any_of(imported.scene.meshes, [](const Mesh& m) { return !m.uvs.empty(); });
  config.version = version, config.command = measure_command_text(options);
  config.scene = scene_json(options, imported, source), config.machine = machine_json(globals);
  config.instance_names = instance_names(imported.scene);
  config.output = options.output, config.force = globals.force, config.max_error = options.max_error;
  RunnerConfig& runner = config.runner;
  runner.scene = options.input;
  const std::set<std::filesystem::path> files(imported.files.begin(), imported.files.end());
  const std::vector<std::filesystem::path> sorted(files.begin(), files.end());
  runner.identity = version + "\n" + state_of(sorted) + shell_command(scene_words(options.scene));
  runner.common = common_words(globals), runner.scene_options = scene_words(options.scene);
  runner.size =
      picture_size(imported.scene, options.camera, options.width.value_or(std::array{320u, 480u, 640u}[mode]));
  runner.camera =
      imported.scene.cameras.empty() && !options.camera ? std::optional<std::string>("auto") : options.camera;
  runner.spp = options.spp.value_or(std::array{64u, 64u, 256u}[mode]);
  runner.distance_samples = std::array<uint64_t, 3>{50'000, kDefaultDistanceSamples, 1'000'000}[mode];
  runner.diagonal = config.matrix_scene.diagonal;
  runner.denoiser = options.denoiser;
  runner.tracer = tracer_words(options);
  return config;
}

void print_matrix(const MeasureConfig& config) {
  const std::vector<MeasurePoint> points = make_matrix(config.mode, config.matrix_scene, config.runner.spp);
  for (const MeasurePoint& point : points)
    print_printable(fmt::format("{:<32} {:<10} bake {}  render {}\n", point.id, point.group,
                                shell_command(words_of(point.bake)),
                                shell_command(render_words(point.render, config.runner))));
  fmt::print("{} points\n", points.size());
}

/// Exit code for a report with failed points: that of the first failed process, 1 if a signal ended it.
int exit_code_of(const nlohmann::json& report) {
  for (const nlohmann::json& point : report.at("points"))
    if (const nlohmann::json& error = point.at("error"); !error.is_null())
      return error.at("exit_code").is_null() ? 1 : error.at("exit_code").get<int>();
  return 0;
}

void print_report(const nlohmann::json& report, const std::string& folder) {
  for (const nlohmann::json& point : report.at("points"))
    if (!point.at("error").is_null())
      print_printable(fmt::format("{}: {} while running {}: {}\n", point.at("id").get<std::string>(),
                                  point.at("status").get<std::string>(),
                                  point.at("error").at("stage").get<std::string>(),
                                  point.at("error").at("message").get<std::string>()),
                      stderr);
  for (const nlohmann::json& answer : report.at("answers")) {
    print_printable(
        fmt::format("{}\n  {}\n", answer.at("question").get<std::string>(), answer.at("text").get<std::string>()));
    if (answer.at("command").is_string()) print_printable("  " + answer.at("command").get<std::string>() + "\n");
  }
  const nlohmann::json& counts = report.at("counts");
  print_printable(fmt::format("{} points, {} failed, {} from earlier runs, {:.1f} s\nwrote {}/report.html\n",
                              counts.at("points").get<int>(), counts.at("failed").get<int>(),
                              counts.at("reused").get<int>(), report.at("seconds").get<double>(), folder));
}

int run(const MeasureOptions& options, const GlobalOptions& globals, const std::string& version) {
  if (options.output.empty() && !options.matrix)
    throw Error(ErrorKind::kUsage,
                "measure needs -o DIR, for example: packtrace measure " + shell_word(options.input) + " -o report");
  JsonOutput json(globals.json, globals.force);
  ProgressDisplay display(globals);
  Progress progress(display.observer());
  MeasureConfig config;
  {
    ImportResult imported = import_for_command(options.input, options.scene, globals, progress, display);
    separate_motion(imported.scene); // as bake does, so that instances have the same numbers
    config = config_of(options, globals, version, imported);
  } // measured processes get the memory
  display.finish();
  if (options.matrix) {
    print_matrix(config);
    return 0;
  }
  const nlohmann::json report = run_measure(config, progress);
  display.finish();
  json.write(report);
  if (!globals.quiet && !json.to_stdout()) print_report(report, options.output);
  return exit_code_of(report);
}

} // namespace

void add_measure_command(CLI::App& app, GlobalOptions& globals, const std::string& version) {
  const auto options = std::make_shared<MeasureOptions>();
  CLI::App& verb =
      add_verb(app, globals, "measure", "Measure size, accuracy and speed of a scene over many options of bake",
               [options, &globals, version] { return run(*options, globals, version); });
  verb.add_option("SCENE", options->input, "pbrt-v3 scene file")->required();
  verb.add_option("-o,--output", options->output, "Folder of the report; an interrupted measurement in it is continued")
      ->type_name("DIR");
  CLI::Option* quick = verb.add_flag("--quick", options->quick, "Measure few points, in about a minute");
  verb.add_flag("--full", options->full, "Measure every point, in large pictures; takes an hour or more")
      ->excludes(quick);
  verb.add_flag("--matrix", options->matrix, "List the points without measuring them");
  verb.add_option("--spp", options->spp,
                  "Samples per pixel of the compared pictures, 1..65536 (default 64; 256 with --full)")
      ->check(number_in(1, 65536))
      ->type_name("N");
  verb.add_option("--width", options->width,
                  "Longer side of the pictures in pixels, 16..16384 (default 480; 320 with --quick, 640 with --full)")
      ->check(number_in(16, 16384))
      ->type_name("N");
  verb.add_option("--camera", options->camera, "Camera number in the scene, or auto for a view of the whole scene")
      ->type_name("I|auto");
  verb.add_option("--denoiser", options->denoiser,
                  "Denoiser of the points that are denoised, as of render: ours or reference (default ours)")
      ->check(one_of({"ours", "reference"}))
      ->type_name("NAME");
  verb.add_option(
          "--backend", options->backend,
          "Ray tracer of the packed files' pictures: packed, gpu with the same hits, or gpu-rt (default packed)")
      ->check(one_of({"packed", "gpu", "gpu-rt"}));
  verb.add_option("--gpu-device", options->gpu_device,
                  "Part of the name of the Vulkan device to use, as of render; requires --backend gpu or gpu-rt")
      ->type_name("NAME");
  verb.add_option(
          "--max-error", options->max_error,
          "Mean absolute error of ambient occlusion that you accept, 0..1 (default 0.005). The report names the "
          "smallest file within it")
      ->check(number_in(0.0, 1.0));
  add_scene_options(verb, options->scene);
  verb.footer("Each point runs in processes of its own. Ambient occlusion is compared with the\n"
              "source floats with the same samples. docs/measure.md describes report.json.\n"
              "Examples:\n"
              "  packtrace measure house.pbrt -o house_report --quick\n"
              "  packtrace measure house.pbrt --matrix --full");
}

} // namespace packtrace
