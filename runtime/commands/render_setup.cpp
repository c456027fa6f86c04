#include "runtime/commands/render_setup.h"

#include <algorithm>

#include <fmt/format.h>

#include "pbrt_import/base/with_file.h"

namespace packtrace {
namespace {

/// Reserves the approximate memory of the G-buffer, the denoiser and the layers of a view. The image size may come from
/// the scene file, so it is not trusted.
MemoryReservation reserve_picture(const RenderOptions& options, const FrameConfig& config, const MemoryBudget& budget) {
  const double pixel_bytes = config.jitters() ? 400.0 : 320.0;
  constexpr double kMax = 0x1p62;
  const double side = config.supersample;
  const double bytes = pixel_bytes * side * side * static_cast<double>(config.size.width) * config.size.height;
  return with_file(options.input, [&] {
    return MemoryReservation(budget, static_cast<uint64_t>(std::min(kMax, bytes)),
                             fmt::format("a picture of {} x {} pixels", config.size.width, config.size.height));
  });
}

} // namespace

RenderSetup::RenderSetup(const RenderOptions& options, const GlobalOptions& globals, bool lod_layers,
                         bool measure_detail, Progress& progress, ProgressDisplay& display)
    : loaded(load_scene(options.input, options.scene, globals, progress, display, options.private_copy)),
      load_s(loading.seconds()) {
  if (options.lod.error_px) require_levels(options.input, loaded);
  camera = choose_camera(*loaded.source, options, globals);
  config = make_config(*loaded.source, camera.camera, options, measure_detail);
  config.lod_layers = lod_layers;
  pixels = reserve_picture(options, config, globals.memory);
  const BakedFile* const file = loaded.baked ? &*loaded.baked : nullptr;
  const FrameScene scene{loaded.source.get(), file, tracer_config(options, globals, file != nullptr)};
  loop = std::make_unique<FrameLoop>(scene, config);
}

} // namespace packtrace
