#include "runtime/commands/compare/geometry_compare.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pbrt_import/base/error.h"
#include "runtime/commands/cli/json_output.h"
#include "runtime/commands/cli/loaded_scene.h"
#include "runtime/measure/surface_error.h"

namespace packtrace {

int compare_geometry(const std::string& test, const std::string& reference, uint64_t samples, const SceneOptions& scene,
                     const GlobalOptions& globals) {
  if (!is_baked_file(test) || is_baked_file(reference))
    throw Error(ErrorKind::kUsage, "compare two images, or a .ptk file with the .pbrt scene that it was baked from");
  JsonOutput json(globals.json, globals.force);
  ProgressDisplay display(globals);
  Progress progress(display.observer());
  const LoadedScene packed = load_scene(test, {}, globals, progress, display);
  const LoadedScene source = load_scene(reference, scene, globals, progress, display);
  const SurfaceError error =
      surface_error(*source.source, *packed.source, *packed.baked, samples, globals.memory, progress);
  display.finish();
  nlohmann::json document = to_json(error);
  document["verb"] = "compare";
  document["test"] = test, document["reference"] = reference;
  document["peak_rss_bytes"] = peak_rss_bytes();
  json.write(document);
  if (json.to_stdout() || globals.quiet) return 0;
  const auto line = [](const char* what, const SurfaceDistance& d) {
    fmt::print("{:<26} max {:.4g}, mean {:.4g}, rms {:.4g}\n", what, d.max, d.mean, d.rms);
  };
  line("distance source to packed", error.to_packed);
  line("distance packed to source", error.to_source);
  fmt::print("{:<26} max {:.4g}, mean {:.4g} degrees\n", "shading normals", error.max_normal_degrees,
             error.mean_normal_degrees);
  fmt::print("{} samples in each direction, {:.4g} per square world unit\n", error.samples, error.samples_per_area);
  if (error.missing_geometries > 0) fmt::print("{} geometries are missing\n", error.missing_geometries);
  return 0;
}

} // namespace packtrace
