#include "runtime/commands/bake/bake_report.h"

#include <algorithm>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "runtime/commands/cli/cli_support.h"
#include "runtime/commands/cli/loaded_scene.h"
#include "runtime/commands/reports/file_report.h"
#include "runtime/commands/reports/requirement_report.h"
#include "runtime/commands/reports/seam_report.h"

namespace packtrace {
namespace {

nlohmann::json promise_json(const BakeReport& baked) {
  nlohmann::json geometries = nlohmann::json::array();
  for (const BrokenPromise& g : baked.promise)
    geometries.push_back({{"name", g.name}, {"bound", g.bound}, {"wanted", g.wanted}, {"step", g.step}});
  return {{"kept", baked.promise.empty()}, {"geometries", geometries}};
}

/// The lines of bake_text() about LOD levels and geometries that are treated specially.
std::string notable_text(const BakeReport& baked) {
  std::string text;
  if (const LodTable& lod = baked.file.lod.all; !lod.levels.empty())
    text +=
        fmt::format(grouped(),
                    "{} coarser LOD levels for {:L} geometries: all levels take {:.3f} bytes per triangle of level 0 "
                    "({:L} triangles)\n",
                    lod.levels.size() - 1, baked.lod_geometries, lod.bytes_per_triangle(), lod.base_triangles());
  else if (baked.lod_candidates > 0)
    text += fmt::format(
        "no coarser LOD levels: none of the {} geometries can be simplified, because their vertices lie on borders "
        "that other geometries share or their triangles are too few\n",
        baked.lod_candidates);
  if (baked.resumed_geometries > 0)
    text += fmt::format(grouped(), "resumed: the LOD levels of {:L} geometries were already finished\n",
                        baked.resumed_geometries);
  if (baked.instanced_shapes > 0)
    text += fmt::format(grouped(), "{:L} shapes outside objects share geometry, which has its own grid\n",
                        baked.instanced_shapes);
  if (baked.nested_geometries > 0)
    text +=
        fmt::format(grouped(), "{:L} geometries have a finer grid, because they are small compared with the scene\n",
                    baked.nested_geometries);
  if (baked.finer_geometries > 0)
    text += fmt::format(
        grouped(), "{:L} geometries have a finer grid, because their triangles or gaps are thin or close to a camera\n",
        baked.finer_geometries);
  if (baked.left_out > 0)
    text += fmt::format(grouped(), "{:L} shapes and instances are dropped, because they exceed the range of floats\n",
                        baked.left_out);
  return text;
}

} // namespace

nlohmann::json bake_json(const BakeOptions& options, const BakeReport& baked, const ImportStatistics& imported,
                         const BakeTimings& timings, bool by_geometry) {
  nlohmann::json json = to_json(baked.file, by_geometry);
  json["verb"] = "bake";
  json["input"] = options.input;
  if (options.inputs.size() > 1) json["inputs"] = options.inputs;
  json["output"] = options.dry_run ? nlohmann::json() : nlohmann::json(options.output);
  json["seconds"] = {{"import", timings.import_s}, {"bake", timings.bake_s}};
  json["peak_rss_bytes"] = peak_rss_bytes();
  json["rms_position_error"] = baked.rms_position_error;
  json["mean_normal_error_degrees"] = baked.mean_normal_error_degrees;
  json["shared_shapes"] = baked.shared_shapes;
  json["instanced_shapes"] = baked.instanced_shapes;
  json["seams"] = seams_json(baked.seams);
  json["shared_objects"] = baked.shared_objects;
  json["unused_objects"] = baked.unused_objects;
  json["left_out"] = baked.left_out;
  json["resumed_geometries"] = baked.resumed_geometries;
  json["nested_geometries"] = baked.nested_geometries;
  json["finer_geometries"] = baked.finer_geometries;
  json["promise"] = promise_json(baked);
  json["median_edge"] = baked.world_median_edge;
  json["import"] = {{"directives", imported.directives},
                    {"files", imported.files_read},
                    {"bytes", imported.bytes_read},
                    {"shapes", imported.shapes},
                    {"shapes_skipped", imported.shapes_skipped},
                    {"cameras_left_out", imported.cameras_left_out},
                    {"textures_found", imported.textures_found},
                    {"textures_missing", imported.textures_missing},
                    {"problems", problems_json(imported)}};
  json["dropped_streams"] = dropped_streams_json(baked.file);
  json["warnings"] = baked.warnings;
  return json;
}

std::string bake_text(const BakeReport& baked) {
  return size_text(baked.file) +
         fmt::format("maximum position error {:.3g} (object units), {}\n", baked.max_position_error,
                     baked.file.normals.empty()
                         ? std::string("no normals stored")
                         : fmt::format("maximum normal error {:.4f} degrees", baked.max_normal_error_degrees)) +
         motion_text(baked.file.motion) + collapsed_text(baked.file) + notable_text(baked) +
         sequences_text(baked.file) + dropped_streams_text(baked.file);
}

std::string precision_warning(const BakeReport& baked, bool chosen) {
  constexpr size_t kMaxShown = 3;
  if (baked.promise.empty()) return {};
  std::vector<BrokenPromise> worst = baked.promise;
  std::stable_sort(worst.begin(), worst.end(), [](const BrokenPromise& a, const BrokenPromise& b) {
    return a.step / a.wanted > b.step / b.wanted;
  });
  std::string text =
      fmt::format("warning: the grid is too coarse for accurate ambient occlusion: {} of {} geometries\n", worst.size(),
                  baked.file.geometries);
  double step = 0.0; // finest step that is required, world units
  for (size_t i = 0; i < worst.size(); ++i) {
    const BrokenPromise& g = worst[i];
    if (!g.float_limit && (step == 0.0 || g.wanted * g.scale < step)) step = g.wanted * g.scale;
    if (i < kMaxShown)
      text += fmt::format("  {}: grid step {:.3g}{}; required {:.2g} ({})\n", g.name, g.step,
                          g.float_limit ? " (limit of float precision)" : "", g.wanted, g.bound);
  }
  if (worst.size() > kMaxShown) text += fmt::format("  and {} more; --json lists them\n", worst.size() - kMaxShown);
  if (step > 0.0)
    text += chosen ? std::string("  without a precision option, bake chooses steps that are fine enough\n")
                   : fmt::format("  --grid-step-abs {:.2g} is fine enough, but makes the file larger\n", step);
  return text;
}

} // namespace packtrace
