#include "runtime/commands/bake/bake_target.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <system_error>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pbrt_import/base/error.h"
#include "runtime/commands/cli/progress_display.h"
#include "runtime/measure/point_runner.h"
#include "runtime/measure/report.h"
#include "runtime/measure/target.h"

namespace packtrace {
namespace {

namespace fs = std::filesystem;

/// A folder that is removed with its content.
class WorkFolder {
public:
  WorkFolder() {
    std::string name = (fs::temp_directory_path() / "packtrace_target_XXXXXX").string();
    if (!::mkdtemp(name.data()))
      throw Error(ErrorKind::kIo, name + ": cannot be created: " + std::generic_category().message(errno));
    path_ = name;
  }
  ~WorkFolder() {
    std::error_code ignored; // nothing is lost if files stay
    fs::remove_all(path_, ignored);
  }
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;
  const fs::path& path() const { return path_; }

private:
  fs::path path_;
};

/// Options that every tried bake has in common and that are not knobs.
Words further_options(const BakeOptions& options) {
  Words words;
  const auto add = [&](const char* name, const std::string& value) { words.insert(words.end(), {name, value}); };
  for (const std::string& stream : options.keep) add("--keep", stream);
  if (options.texture_psnr) add("--texture-psnr", number_text(*options.texture_psnr));
  if (options.lod_min_triangles) add("--lod-min-triangles", std::to_string(*options.lod_min_triangles));
  if (options.lod_levels) add("--lod-levels", std::to_string(*options.lod_levels));
  if (options.motion) add("--motion", *options.motion);
  if (!options.keys.empty()) add("--keys", options.keys);
  return words;
}

GridKind grid_kind(PrecisionKind kind) {
  switch (kind) {
  case PrecisionKind::kPicture:
    return GridKind::kDefault;
  case PrecisionKind::kPositionBits:
    return GridKind::kBits;
  case PrecisionKind::kDiagonalFraction:
    return GridKind::kRelative;
  case PrecisionKind::kAbsolute:
    return GridKind::kAbsolute;
  case PrecisionKind::kEdgeFraction:
    return GridKind::kEdge;
  }
  return GridKind::kDefault;
}

TargetSearch search_of(const BakeOptions& options) {
  TargetSearch search;
  for (const std::string& text : options.targets) search.targets.push_back(parse_target(text));
  search.free_grid = !chooses_grid(options);
  search.free_normals = !options.normals && !options.normal_error;
  BakeKnobs& base = search.base;
  base.grid = grid_kind(options.config.precision_kind);
  if (base.grid != GridKind::kDefault) base.grid_value = options.config.precision;
  base.normals = options.normals.value_or("auto"), base.normal_error = options.normal_error;
  base.uvs = options.uvs, base.textures = options.textures.value_or("");
  base.codec = options.codec.value_or("small"), base.trees = options.trees.value_or("off");
  base.lod = options.lod, base.purpose = options.purpose;
  return search;
}

RunnerConfig runner_config(const BakeOptions& options, const GlobalOptions& globals) {
  RunnerConfig config;
  config.scene = options.input;
  config.common = {"--max-memory", std::to_string(globals.memory.limit())};
  if (globals.threads > 0) config.common.insert(config.common.end(), {"--threads", std::to_string(globals.threads)});
  SceneOptions scene = options.scene;
  scene.strict = false; // the bake itself reports problems
  config.scene_options = scene_words(scene);
  config.bake_options = further_options(options);
  config.size = {320, 180};
  config.camera = options.camera;
  config.embree_beside_each_point = false;
  return config;
}

void take(BakeOptions& options, const BakeKnobs& knobs) {
  if (knobs.grid == GridKind::kBits) {
    options.config.precision_kind = PrecisionKind::kPositionBits;
    options.config.precision = knobs.grid_value;
  }
  if (knobs.normals != "auto") options.normals = knobs.normals;
  options.normal_error = knobs.normal_error;
  options.codec = knobs.codec, options.trees = knobs.trees;
}

/// A line about the camera of the compared pictures. @param camera as in the JSON of render
std::string camera_text(const nlohmann::json& camera) {
  if (camera.at("index").is_number())
    return fmt::format("compared with camera {} of the scene\n", camera.at("index").get<uint32_t>());
  const nlohmann::json& reason = camera.at("reason");
  return "compared in a view of the whole scene" + (reason.is_null() ? "" : ": " + reason.get<std::string>()) + "\n";
}

nlohmann::json summary_of(const TargetResult& result, const TargetSearch& search, const nlohmann::json& camera) {
  nlohmann::json limits = nlohmann::json::object(), tried = nlohmann::json::array();
  for (const Target& target : search.targets) limits[name_of(target.kind)] = target.limit;
  for (const nlohmann::json& point : result.tried)
    tried.push_back({{"id", point.at("id")},
                     {"knobs", point.at("knobs")},
                     {"status", point.at("status")},
                     {"error", point.at("error")},
                     {"bytes", point.at("bytes")},
                     {"ao", point.at("ao")},
                     {"normal", point.at("normal")},
                     {"position", point.at("position")}});
  return {{"limits", limits},
          {"camera", camera},
          {"tried", tried},
          {"chosen", result.best ? nlohmann::json(*result.best) : nullptr}};
}

} // namespace

nlohmann::json find_target(BakeOptions& options, const GlobalOptions& globals) {
  if (!options.scene.joined_files.empty())
    throw Error(ErrorKind::kUsage,
                "--target measures one file; join the others in a .pbrt scene with Shape \"plymesh\"");
  const TargetSearch search = search_of(options);
  const WorkFolder work;
  const MeasureFolder folder(work.path(), {{"scene", options.input}}, false);
  PointRunner runner(runner_config(options, globals), folder);
  ProgressDisplay display(globals);
  Progress progress(display.observer());
  progress.begin("searching", 0);
  const nlohmann::json reference = runner.make_reference();
  const bool limits_ao =
      std::ranges::any_of(search.targets, [](const Target& t) { return t.kind == TargetKind::kAoError; });
  if (const auto noise = number_at(reference, "noise_floor.mae"); limits_ao && !(noise.value_or(0.0) > 0.0))
    throw Error(ErrorKind::kUsage,
                "--target ao-error: the pictures show no occlusion, so any file would keep it; choose "
                "another --camera, or limit position-error");
  size_t number = 0;
  const TargetResult result = search_target(search, [&](const BakeKnobs& knobs) {
    progress.advance();
    MeasurePoint point;
    point.id = std::to_string(number++), point.bake = knobs, point.render.spp = 64;
    return runner.measure(point);
  });
  display.finish();
  if (!globals.quiet || !result.best)
    print_printable(camera_text(reference.at("camera")) + to_text(result, search.targets), stderr);
  if (!result.best)
    throw Error(ErrorKind::kLimitExceeded, "no options keep the target" +
                                               std::string(search.targets.size() > 1 ? "s" : "") +
                                               "; the table above has what was tried");
  take(options, result.knobs[*result.best]);
  return summary_of(result, search, reference.at("camera"));
}

} // namespace packtrace
