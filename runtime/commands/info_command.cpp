#include "runtime/commands/info_command.h"

#include <memory>
#include <string>

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
  bool strict = false;
};

nlohmann::json to_json(const ImportResult& imported) {
  const Scene& scene = imported.scene;
  const ImportStatistics& statistics = imported.statistics;
  const Bounds bounds = world_bounds(scene);
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
      {"masks", scene.masks.size()},
      {"cameras", scene.cameras.size()},
      {"area_lights", statistics.area_lights},
      {"light_sources", statistics.light_sources},
      {"textures_found", statistics.textures_found},
      {"textures_missing", statistics.textures_missing},
      {"directives", statistics.directives},
      {"files", statistics.files_read},
      {"file_bytes", statistics.bytes_read},
      {"bounds", {{"lo", {bounds.lo.x, bounds.lo.y, bounds.lo.z}}, {"hi", {bounds.hi.x, bounds.hi.y, bounds.hi.z}}}}};
}

std::string to_text(const ImportResult& imported) {
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
  text += "shapes";
  for (const auto& [kind, count] : s.shapes) text += fmt::format(grouped(), "   {} {:L}", kind, count);
  return text + fmt::format(grouped(), "   ({:L} skipped, {:L} absent)\n", s.shapes_skipped, s.shapes_absent);
}

int run(const InfoOptions& options, const GlobalOptions& globals) {
  JsonOutput json(globals.json, globals.force);
  ProgressDisplay display(globals);
  Progress progress(display.observer());
  nlohmann::json document;
  std::string text;
  if (is_baked_file(options.input)) {
    const FileSummary summary = summarize(BakedFile::open(options.input));
    document = to_json(summary);
    text = to_text(summary);
  } else {
    const ImportResult imported = import_for_command(options.input, options.strict, globals, progress, display);
    document = to_json(imported);
    text = to_text(imported);
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
  verb.add_flag("--strict", options->strict, "Fail if a .pbrt scene has any problem");
  verb.footer("Example:\n  packtrace info house.ptk --json -");
}

} // namespace packtrace
