#include "runtime/commands/view/view_files.h"

#include <algorithm>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "compress/format/file/baked_file.h"
#include "compress/format/file/file_summary.h"
#include "pbrt_import/scene/world_view.h"
#include "runtime/commands/cli/whole_number.h"
#include "runtime/commands/render/render_camera.h"
#include "runtime/commands/reports/file_report.h"
#include "runtime/motion/motion_targets.h"

namespace packtrace {
namespace {

/// What a ViewFile refers to.
struct LoadedView {
  explicit LoadedView(const auto& load) : scene(load()) {}

  LoadedScene scene; ///< not movable: its source refers to it
  SceneMotion motion;
  std::optional<MotionTargets> targets; ///< none until they are needed
  std::optional<FileSummary> summary;   ///< the same

  const FileSummary& file_summary() {
    if (!summary) summary = summarize(*scene.baked);
    return *summary;
  }
};

MotionTargets targets_of(const LoadedScene& scene) {
  return scene.baked ? motion_targets(*scene.baked) : motion_targets(*scene.imported);
}

std::vector<std::string> material_names(const LoadedScene& scene) {
  std::vector<std::string> names;
  if (scene.baked)
    for (const baked::MaterialRecord& material : scene.baked->sections().materials)
      names.emplace_back(scene.baked->sections().text(material.name));
  else
    for (const Material& material : scene.imported->materials) names.push_back(material.name);
  return names;
}

/// The options of `render` with which it loads and traces the file in the same way.
std::vector<std::string> loading_words(const RenderOptions& o) {
  std::vector<std::string> words;
  const auto add = [&](const char* name, const auto& value) {
    if (!value) return;
    words.emplace_back(name);
    words.push_back(fmt::format("{}", *value));
  };
  add("--world", o.scene.world);
  add("--time", o.scene.time);
  add("--animation", o.scene.animation);
  add("--backend", o.backend);
  add("--gpu-device", o.gpu_device);
  add("--bvh", o.bvh);
  if (o.fast_edges) words.emplace_back("--fast-edges");
  add("--lod-error", o.lod.error_px);
  add("--lod-scheme", o.lod.scheme);
  add("--lod-traced-ratio", o.lod.traced_ratio);
  add("--lod-culled-scale", o.lod.culled_scale);
  add("--lod-tolerance", o.lod.tolerance);
  add("--lod-rays", o.lod.rays);
  add("--lod-cull", o.lod.cull);
  return words;
}

/// The number of the camera whose projection the view has, as text.
std::string base_camera(const RenderOptions& options) {
  const std::string name = options.camera.value_or("0");
  const std::string number = name.substr(0, std::min(name.find(':'), name.size()));
  return whole_number(number) ? number : "0";
}

} // namespace

ViewFile load_view_file(const std::string& name, const RenderOptions& options, const GlobalOptions& globals,
                        const DetailConfig& detail, Progress& progress, ProgressDisplay& display) {
  // A private copy: the file may be replaced while it is shown.
  SceneOptions scene = options.scene;
  scene.keep_shading = true;
  const auto loaded =
      std::make_shared<LoadedView>([&] { return load_scene(name, scene, globals, progress, display, true); });
  if (detail.error_px) require_levels(name, loaded->scene);
  const BakedFile* const baked = loaded->scene.baked ? &*loaded->scene.baked : nullptr;
  loaded->motion = baked != nullptr ? SceneMotion::of(*baked) : SceneMotion::of(*loaded->scene.imported);
  ViewFile file;
  file.name = name;
  file.owner = loaded;
  file.at_rest.source = loaded->scene.source.get();
  file.at_rest.file = baked;
  file.at_rest.backend = tracer_config(options, globals, baked != nullptr);
  file.at_rest.memory = globals.memory;
  file.moving = file.at_rest;
  if (loaded->motion.moves()) file.moving.motion = &loaded->motion;
  file.moving.deforms = baked != nullptr && !baked->sections().deformation.empty();
  file.begin_s = loaded->motion.begin_s(), file.end_s = loaded->motion.end_s();
  file.motion = &loaded->motion;
  file.targets = [cache = loaded.get()]() -> const MotionTargets& {
    if (!cache->targets) cache->targets = targets_of(cache->scene);
    return *cache->targets;
  };
  file.material_names = material_names(loaded->scene);
  if (baked != nullptr) {
    file.stream_bytes = [cache = loaded.get()] { return stream_bytes(cache->file_summary().bytes); };
    file.geometry_names = [cache = loaded.get()] {
      std::vector<std::string> names;
      for (const GeometryUse& use : cache->file_summary().by_geometry) names.push_back(use.name);
      return names;
    };
  }
  file.words = loading_words(options);
  file.base_camera = base_camera(options);
  return file;
}

ViewCamera start_camera(const ViewFile& file, const RenderOptions& options, const GlobalOptions& globals) {
  const SceneSource& source = *file.at_rest.source;
  RenderOptions shown = options;
  shown.input = file.name;
  const ChosenCamera chosen = choose_camera(source, shown, globals);
  const Bounds bounds = source.world_bounds();
  const double to_centre = glm::length(bounds.centre() - DVec3(chosen.camera.world_from_camera[3]));
  const double distance = to_centre > 0.0 ? to_centre : std::max(bounds.diagonal(), 1e-30);
  const DVec3 up = estimate_world_view(source.cameras()).up;
  if (chosen.index || source.cameras().empty()) {
    ViewCamera camera(chosen.camera, source.origin(), up, distance);
    if (!chosen.index) camera.set(camera.current_key());
    return camera;
  }
  ViewCamera placed(chosen.camera, source.origin(), up, distance);
  shown.camera = file.base_camera;
  ViewCamera camera(choose_camera(source, shown, globals).camera, source.origin(), up, distance);
  camera.set(placed.current_key());
  return camera;
}

} // namespace packtrace
