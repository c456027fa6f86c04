#include "runtime/commands/render/render_setup.h"

#include <algorithm>

#include <fmt/format.h>

#include "pbrt_import/base/file_error.h"
#include "pbrt_import/base/with_file.h"
#include "runtime/commands/render/image_outputs.h"
#include "runtime/motion/motion_keys.h"

namespace packtrace {
namespace {

/// Reserves picture_bytes(). The image size may come from
/// the scene file, so it is not trusted.
MemoryReservation reserve_picture(const RenderOptions& options, const FrameConfig& config, const MemoryBudget& budget) {
  return with_file(options.input, [&] {
    return MemoryReservation(budget, picture_bytes(config),
                             fmt::format("a picture of {} x {} pixels", config.size.width, config.size.height));
  });
}

SceneOptions scene_options(const RenderOptions& options) {
  SceneOptions scene = options.scene;
  scene.keep_shading = options.shade.shades();
  return scene;
}

/// Whether the scene is shown at a time, not at rest.
bool shows_motion(const RenderOptions& options) {
  return options.sequence.path || options.sequence.keys || options.sequence.start_time;
}

} // namespace

RenderSetup::RenderSetup(const RenderOptions& options, const GlobalOptions& globals, const DetailConfig& detail,
                         const std::vector<std::string>& layers, Progress& progress, ProgressDisplay& display)
    : loaded(load_scene(options.input, scene_options(options), globals, progress, display, options.private_copy)),
      load_s(loading.seconds()) {
  if (detail.error_px) require_levels(options.input, loaded);
  if (options.shade.shades() && !loaded.source->has_shading())
    throw FileError(ErrorKind::kUnsupported, options.input,
                    "it holds no materials and lights, which --view " + options.shade.view +
                        " needs; bake it again with --for shading");
  camera = choose_camera(*loaded.source, options, globals);
  prepare_motion(options, globals);
  config = make_config(*loaded.source, camera.camera, options, detail);
  config.lod_layers = has_lod_layer(layers);
  config.view_layers = has_view_layer(layers);
  config.all_channels = false;
  config.plain_layers = kDepthLayer | kInstanceLayer; // reports need them
  for (const std::string& layer : layers) config.plain_layers |= plain_layers_of(layer);
  config.surface_layers = has_surface_layer(layers), config.cost_layers = has_cost_layer(layers);
  pixels = reserve_picture(options, config, globals.memory);
  const BakedFile* const file = loaded.baked ? &*loaded.baked : nullptr;
  const TracerConfig backend = tracer_config(options, globals, file != nullptr);
  if (config.cost_layers && backend.backend != Backend::kPacked)
    throw Error(ErrorKind::kUsage, "--aov visited_nodes and the like require --backend packed");
  const FrameScene scene{loaded.source.get(),   file, backend,       motion.moves() ? &motion : nullptr,
                         shows_motion(options), {},   globals.memory};
  loop = std::make_unique<FrameLoop>(scene, config);
}

/// Reads the motion of the scene if a sequence or a time other than that of the scene at rest is wanted.
void RenderSetup::prepare_motion(const RenderOptions& options, const GlobalOptions& globals) {
  const SequenceOptions& sequence = options.sequence;
  if (!shows_motion(options)) return;
  motion = loaded.baked ? SceneMotion::of(*loaded.baked) : SceneMotion::of(*loaded.imported);
  if (sequence.keys) {
    const MotionTargets targets = loaded.baked ? motion_targets(*loaded.baked) : motion_targets(*loaded.imported);
    motion.add(read_motion_keys(*sequence.keys, targets, globals.memory), targets);
  }
  time_s = sequence.start_time.value_or(motion.begin_s());
  if (camera.index) camera.camera = motion.camera(*camera.index, time_s).value_or(camera.camera);
}

} // namespace packtrace
