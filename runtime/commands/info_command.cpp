#include "runtime/commands/commands.h"

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pbrt_import/base/error.h"
#include "pbrt_import/scene/motion_pose.h"
#include "runtime/commands/cli/cli_support.h"
#include "runtime/commands/cli/json_output.h"
#include "runtime/commands/cli/loaded_scene.h"
#include "runtime/commands/cli/progress_display.h"
#include "runtime/commands/reports/file_report.h"
#include "runtime/commands/reports/seam_report.h"

namespace packtrace {
namespace {

/// The time over which things of a scene are animated; empty if nothing is.
TimeSpan animated_time(const Scene& scene) {
  TimeSpan span = time_span(scene.motion);
  for (const AnimatedTransform& animation : scene.animations) {
    const bool first = span.begin_s > span.end_s;
    span = {first ? animation.start_time : std::min(span.begin_s, animation.start_time),
            first ? animation.end_time : std::max(span.end_s, animation.end_time)};
  }
  return span;
}

struct InfoOptions {
  std::vector<std::string> inputs;
  SceneOptions scene;
};

const char* name_of(Projection projection) {
  switch (projection) {
  case Projection::kPerspective:
    return "perspective";
  case Projection::kOrthographic:
    return "orthographic";
  case Projection::kEnvironment:
    return "environment";
  }
  return "unknown";
}

nlohmann::json to_json(const Camera& camera) {
  nlohmann::json json = {{"projection", name_of(camera.projection)},
                         {"width", camera.width_px},
                         {"height", camera.height_px},
                         {"film", camera.film_name},
                         {"shutter", {camera.shutter_open, camera.shutter_close}},
                         {"animated", camera.animation != kNotAnimated}};
  if (camera.projection == Projection::kPerspective) json["fov"] = camera.fov_degrees;
  if (const auto& w = camera.screen_window) json["screen_window"] = {w->x, w->y, w->z, w->w};
  return json;
}

nlohmann::json to_json(const ImportResult& imported, uint32_t world) {
  const Scene& scene = imported.scene;
  const ImportStatistics& statistics = imported.statistics;
  Bounds bounds = world_bounds(scene);
  bounds.lo += scene.origin, bounds.hi += scene.origin;
  const TimeSpan time = animated_time(scene);
  const bool still = time.begin_s > time.end_s;
  nlohmann::json cameras = nlohmann::json::array();
  for (const Camera& camera : scene.cameras) cameras.push_back(to_json(camera));
  return {
      {"triangles", unique_triangle_count(scene)},
      {"placed_triangles", placed_triangle_count(scene)},
      {"dropped_triangles", scene.dropped_triangles},
      {"meshes", scene.meshes.size()},
      {"shapes", statistics.shapes},
      {"shapes_skipped", statistics.shapes_skipped},
      {"shapes_absent", statistics.shapes_absent},
      {"objects", scene.objects.size()},
      {"instances", scene.instances.size()},
      {"materials", scene.materials.size()},
      {"materials_by_kind", statistics.materials},
      {"masks", scene.masks.size()},
      {"cameras", scene.cameras.size()},
      {"cameras_left_out", statistics.cameras_left_out},
      {"camera_list", std::move(cameras)},
      {"area_lights", statistics.area_lights},
      {"light_sources", statistics.light_sources},
      {"textures_found", statistics.textures_found},
      {"textures_missing", statistics.textures_missing},
      {"worlds", statistics.worlds},
      {"world", world},
      {"time", scene.time},
      {"animated",
       {{"shapes", statistics.animated_shapes},
        {"instances", statistics.animated_instances},
        {"cameras", statistics.animated_cameras},
        {"begin_s", still ? nlohmann::json() : nlohmann::json(time.begin_s)},
        {"end_s", still ? nlohmann::json() : nlohmann::json(time.end_s)}}},
      {"ignored", statistics.ignored},
      {"problems", problems_json(statistics)},
      {"directives", statistics.directives},
      {"files", statistics.files_read},
      {"file_bytes", statistics.bytes_read},
      {"bounds", {{"lo", {bounds.lo.x, bounds.lo.y, bounds.lo.z}}, {"hi", {bounds.hi.x, bounds.hi.y, bounds.hi.z}}}}};
}

/// Formats counts as "title   a 1   b 2", without a newline.
std::string row_of(std::string_view title, const std::map<std::string, uint64_t>& counts) {
  std::string row(title);
  for (const auto& [name, count] : counts) row += fmt::format(grouped(), "   {} {:L}", name, count);
  std::replace(row.begin(), row.end(), '_', ' ');
  return row;
}

std::string to_text(const ImportResult& imported, uint32_t world) {
  const Scene& scene = imported.scene;
  const ImportStatistics& s = imported.statistics;
  std::string text = fmt::format(
      grouped(), "triangles {:L} ({:L} placed, {:L} dropped)   meshes {:L}   objects {:L}   instances {:L}\n",
      unique_triangle_count(scene), placed_triangle_count(scene), scene.dropped_triangles, scene.meshes.size(),
      scene.objects.size(), scene.instances.size());
  text += fmt::format(grouped(),
                      "materials {:L}   masks {:L}   cameras {:L}   area lights {:L}   lights {:L}   textures {:L} "
                      "found, {:L} missing\n",
                      scene.materials.size(), scene.masks.size(), scene.cameras.size(), s.area_lights, s.light_sources,
                      s.textures_found, s.textures_missing);
  const DVec3 extent = world_bounds(scene).extent();
  text += fmt::format(grouped(), "bounds {:.6g} x {:.6g} x {:.6g}   read {:L} bytes in {:L} files\n", extent.x,
                      extent.y, extent.z, s.bytes_read, s.files_read);
  text += row_of("shapes", s.shapes) +
          fmt::format(grouped(), "   ({:L} skipped, {:L} absent)\n", s.shapes_skipped, s.shapes_absent);
  if (!s.materials.empty()) text += row_of("materials by kind", s.materials) + "\n";
  for (const Camera& camera : scene.cameras)
    text += fmt::format("camera   {} {}x{} \"{}\"{}\n", name_of(camera.projection), camera.width_px, camera.height_px,
                        camera.film_name, camera.animation == kNotAnimated ? "" : "   animated");
  text += left_out_cameras_text(imported);
  if (s.worlds > 1) text += fmt::format("world {} of {}\n", world, s.worlds);
  if (s.animated_shapes + s.animated_instances + s.animated_cameras > 0) {
    const TimeSpan time = animated_time(scene);
    text += fmt::format(
        grouped(), "animated   shapes {:L}   instances {:L}   cameras {:L}   from time {} to {} (shown at {})\n",
        s.animated_shapes, s.animated_instances, s.animated_cameras, time.begin_s, time.end_s, scene.time);
  }
  if (!s.ignored.empty()) text += row_of("ignored", s.ignored) + "\n";
  return text;
}

/// The reports about one file.
struct FileInfo {
  nlohmann::json json;
  std::string text;
  std::string row; ///< row of the table that is printed for several files
};

std::string table_row(const std::string& file, uint64_t triangles, uint64_t placed, uint64_t bytes,
                      const std::string& error) {
  const double per = triangles > 0 ? static_cast<double>(bytes) / static_cast<double>(triangles) : 0.0;
  return fmt::format(grouped(), "{:>14L}{:>14L}{:>15L}{:>10.2f}{:>12}  {}\n", triangles, placed, bytes, per, error,
                     file);
}

std::string table_heading() {
  return fmt::format("{:>14}{:>14}{:>15}{:>10}{:>12}  {}\n", "triangles", "placed", "bytes", "per tri.", "pos. error",
                     "file");
}

FileInfo info_of(const std::string& input, const InfoOptions& options, const GlobalOptions& globals, Progress& progress,
                 ProgressDisplay& display) {
  FileInfo info;
  if (is_baked_file(input)) {
    require_no_scene_choice(input, options.scene);
    refuse_to_replace({input});
    const MemoryReservation memory = reserve_decoded(input, globals.memory);
    const BakedFile file = BakedFile::open(input);
    const FileSummary summary = summarize(file);
    const SeamSummary seams = InstanceSeams(file).summary();
    info.json = to_json(summary, globals.verbosity > 0);
    info.json["seams"] = seams_json(seams);
    info.text = to_text(summary, globals.verbosity > 0) + seams_text(seams);
    info.row = table_row(input, summary.triangles, summary.placed_triangles, summary.disk.file_bytes,
                         fmt::format("{:.3g}", summary.max_position_error));
  } else {
    const ImportResult imported = import_for_command(input, options.scene, globals, progress, display);
    info.json = to_json(imported, options.scene.world.value_or(1));
    info.text = to_text(imported, options.scene.world.value_or(1));
    info.row = table_row(input, unique_triangle_count(imported.scene), placed_triangle_count(imported.scene),
                         imported.statistics.bytes_read, "");
  }
  info.json["verb"] = "info";
  info.json["input"] = input;
  return info;
}

int run_one(const InfoOptions& options, const GlobalOptions& globals) {
  JsonOutput json(globals.json, globals.force);
  ProgressDisplay display(globals);
  Progress progress(display.observer());
  const FileInfo info = info_of(options.inputs.front(), options, globals, progress, display);
  if (json.wanted()) json.write(info.json);
  if (!json.to_stdout() && !globals.quiet) print_printable(info.text);
  return 0;
}

/// Prints a table with a row per file, or with -v the full report of each file. Files that cannot be read are reported
/// and skipped; the first failure determines the exit code.
int run_several(const InfoOptions& options, const GlobalOptions& globals) {
  JsonOutput json(globals.json, globals.force);
  nlohmann::json documents = nlohmann::json::array();
  const bool shown = !json.to_stdout() && !globals.quiet, in_full = globals.verbosity > 0;
  int code = 0;
  if (shown && !in_full) fmt::print("{}", table_heading());
  for (const std::string& input : options.inputs) {
    ProgressDisplay display(globals);
    Progress progress(display.observer());
    try {
      FileInfo info = info_of(input, options, globals, progress, display);
      if (shown) print_printable(in_full ? fmt::format("== {}\n{}\n", input, info.text) : info.row);
      documents.push_back(std::move(info.json));
    } catch (const Error& error) {
      if (error.kind() == ErrorKind::kCancelled || error.kind() == ErrorKind::kUsage) throw;
      display.finish();
      std::fflush(stdout); // keeps the output of the two streams in order
      report_error(error);
      if (code == 0) code = error.exit_code();
      documents.push_back({{"verb", "info"}, {"input", input}, {"error", error_json(error)}});
    }
  }
  if (json.wanted()) json.write(documents);
  return code;
}

} // namespace

void add_info_command(CLI::App& app, GlobalOptions& globals) {
  const auto options = std::make_shared<InfoOptions>();
  CLI::App& verb =
      add_verb(app, globals, "info", "Show contents, sizes and errors of .ptk files, .pbrt scenes and meshes",
               [options, &globals] {
                 return options->inputs.size() == 1 ? run_one(*options, globals) : run_several(*options, globals);
               });
  verb.add_option("FILE", options->inputs,
                  "One or more .ptk files or .pbrt scenes. For several files a table with one row per file is printed; "
                  "-v prints each in full")
      ->required();
  add_scene_options(verb, options->scene);
  verb.footer("For a .ptk file: counts, grid steps, errors measured against the source, bytes\n"
              "per stream, LOD levels, and why each stream is stored or dropped. For a scene:\n"
              "shapes, materials, cameras and everything that was ignored.\n"
              "Examples:\n"
              "  packtrace info house.ptk\n"
              "  packtrace info house.ptk -v\n"
              "  packtrace info *.ptk\n"
              "  packtrace info house.ptk --json - | jq .bytes_per_triangle");
}

} // namespace packtrace
