#include "runtime/commands/info_command.h"

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "runtime/commands/cli_support.h"
#include "runtime/commands/file_report.h"
#include "runtime/commands/json_output.h"
#include "runtime/commands/loaded_scene.h"
#include "runtime/commands/progress_display.h"

namespace packtrace {
namespace {

struct InfoOptions {
  std::string input;
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
  const Bounds bounds = world_bounds(scene);
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
        {"cameras", statistics.animated_cameras}}},
      {"ignored", statistics.ignored},
      {"problems", problems_json(statistics)},
      {"directives", statistics.directives},
      {"files", statistics.files_read},
      {"file_bytes", statistics.bytes_read},
      {"bounds", {{"lo", {bounds.lo.x, bounds.lo.y, bounds.lo.z}}, {"hi", {bounds.hi.x, bounds.hi.y, bounds.hi.z}}}}};
}

/// "title   a 1   b 2", without its end of line.
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
  if (s.worlds > 1) text += fmt::format("world {} of {}\n", world, s.worlds);
  if (s.animated_shapes + s.animated_instances + s.animated_cameras > 0)
    text += fmt::format(grouped(), "animated   shapes {:L}   instances {:L}   cameras {:L}   (shown as at time {})\n",
                        s.animated_shapes, s.animated_instances, s.animated_cameras, scene.time);
  if (!s.ignored.empty()) text += row_of("ignored", s.ignored) + "\n";
  return text;
}

int run(const InfoOptions& options, const GlobalOptions& globals) {
  JsonOutput json(globals.json, globals.force);
  ProgressDisplay display(globals);
  Progress progress(display.observer());
  nlohmann::json document;
  std::string text;
  if (is_baked_file(options.input)) {
    require_no_scene_choice(options.input, options.scene);
    const FileSummary summary = summarize(BakedFile::open(options.input));
    document = to_json(summary, globals.verbosity > 0);
    text = to_text(summary, globals.verbosity > 0);
  } else {
    const ImportResult imported = import_for_command(options.input, options.scene, globals, progress, display);
    document = to_json(imported, options.scene.world);
    text = to_text(imported, options.scene.world);
  }
  document["verb"] = "info";
  document["input"] = options.input;
  if (json.wanted()) json.write(document);
  if (!json.to_stdout() && !globals.quiet) fmt::print("{}", text);
  return 0;
}

} // namespace

void add_info_command(CLI::App& app, GlobalOptions& globals) {
  const auto options = std::make_shared<InfoOptions>();
  CLI::App& verb = add_verb(app, globals, "info", "Say what a .ptk file or a .pbrt scene holds",
                            [options, &globals] { return run(*options, globals); });
  verb.add_option("FILE", options->input, "A .ptk file or a .pbrt scene")->required();
  add_scene_options(verb, options->scene);
  verb.footer("Example:\n  packtrace info house.ptk --json -");
}

} // namespace packtrace
