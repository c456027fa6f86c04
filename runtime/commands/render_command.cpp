#include "runtime/commands/commands.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/with_file.h"
#include "runtime/commands/binary_output.h"
#include "runtime/commands/image_outputs.h"
#include "runtime/commands/json_output.h"
#include "runtime/commands/progress_display.h"
#include "runtime/commands/render_camera.h"
#include "runtime/commands/render_options.h"
#include "runtime/commands/render_report.h"
#include "runtime/commands/seam_report.h"
#include "runtime/stopwatch.h"

namespace packtrace {
namespace {

/// Reserves the approximate memory of the G-buffer, the denoiser and the layers of a view. The image size may come from
/// the scene file, so it is not trusted.
MemoryReservation reserve_picture(const RenderOptions& options, const RenderConfig& config,
                                  const MemoryBudget& budget) {
  constexpr double kPixelBytes = 320.0, kMax = 0x1p62;
  const double side = config.supersample;
  const double bytes = kPixelBytes * side * side * static_cast<double>(config.size.width) * config.size.height;
  return with_file(options.input, [&] {
    return MemoryReservation(budget, static_cast<uint64_t>(std::min(kMax, bytes)),
                             fmt::format("a picture of {} x {} pixels", config.size.width, config.size.height));
  });
}

/// A rendered view and the objects it was traced with.
struct Traced {
  ChosenCamera camera;
  std::optional<ChosenDetail> detail;
  std::vector<std::unique_ptr<RayTracer>> tracers; ///< the camera's; with --lod-rays occlusion also the occlusion rays'
  RenderedImage image;
};

Traced trace(const RenderOptions& options, const GlobalOptions& globals, const LoadedScene& loaded, RenderConfig config,
             ChosenCamera chosen, const TracerConfig& backend, Progress& progress) {
  Traced traced;
  traced.camera = std::move(chosen);
  double build_s = 0.0;
  const auto build = [&](const auto& make) {
    const Stopwatch building;
    with_file(options.input, [&] { traced.tracers.push_back(make()); });
    build_s += building.seconds();
  };
  const auto choose = [&](const GBuffer* seen) {
    traced.detail.emplace(choose_detail(loaded, traced.camera.camera, config, options.lod, seen));
    build([&] { return make_tracer(*traced.detail->source, *loaded.baked, backend); });
  };
  ChooseOccluders occluders;
  if (options.lod.only_occlusion())
    occluders = [&](const GBuffer& seen, const PrimaryCamera&) {
      choose(&seen);
      return Occluders{traced.detail->source.get(), traced.tracers[1].get(), *options.lod.error_px};
    };
  const bool camera_uses_lod = options.lod.error_px && !options.lod.only_occlusion();
  const auto render = [&] {
    progress.begin("bvh", 0);
    if (camera_uses_lod) { // the cut depends on the camera
      traced.tracers.clear();
      choose(nullptr);
    } else if (traced.tracers.empty()) {
      build([&] { return make_tracer(*loaded.source, loaded.baked ? &*loaded.baked : nullptr, backend); });
    }
    const SceneSource& source = camera_uses_lod ? *traced.detail->source : *loaded.source;
    traced.image = render_view(source, *traced.tracers[0], traced.camera.camera, config, progress, occluders);
  };
  config.stop_if_nothing_visible = !options.camera && traced.camera.index;
  render();
  if (!traced.image.seen && config.stop_if_nothing_visible) {
    traced.camera = frame_whole_scene(traced.camera, *loaded.source, config.size, options, globals);
    config.stop_if_nothing_visible = false;
    render();
  }
  traced.image.timings.build_s = build_s;
  return traced;
}

/// Warns about instances that are not traced because their transform is degenerate.
/// @param count number of these instances
void warn_of_flat_instances(const std::string& input, size_t count) {
  if (count == 0) return;
  print_printable(
      fmt::format("{}: warning: {} instance{} not traced: flattened to a line or a point by the transform\n", input,
                  count, count == 1 ? " is" : "s are"),
      stderr);
}

/// Throws Error(kUsage) for two outputs to standard output, and for LOD layers of a render that has none.
void check_targets(const RenderOptions& options, const ImageOutputs& outputs, const JsonOutput& json) {
  if (outputs.to_stdout() && json.to_stdout())
    throw Error(ErrorKind::kUsage, "-o - and --json - would both write to standard output; use a file for one of them");
  if (outputs.has_lod_layers() && !options.lod.error_px)
    throw Error(ErrorKind::kUsage, "the layers lod and lod-error require --lod-error");
  if (outputs.has_lod_layers() && options.lod.only_occlusion())
    throw Error(ErrorKind::kUsage,
                "the layers lod and lod-error do not work with --lod-rays occlusion, where the camera sees "
                "level 0");
}

int run(const RenderOptions& options, const GlobalOptions& globals) {
  if (options.outputs.empty()) fail_without_output("render", options.input, ".png");
  tracer_config(options, globals, false); // reports wrong options before any work
  if (!options.size.empty()) parse_size(options.size);
  validate(options.lod);
  JsonOutput json(globals.json, globals.force);
  const bool camera_uses_lod = options.lod.error_px && !options.lod.only_occlusion();
  ImageOutputs outputs(options.outputs, options.aovs, camera_uses_lod, globals.force,
                       preview_style(options)); // reports unwritable files before any work
  check_targets(options, outputs, json);
  ProgressDisplay display(globals);
  Progress progress(display.observer());
  FileTimings timings;
  const Stopwatch loading;
  const LoadedScene loaded = load_scene(options.input, options.scene, globals, progress, display, options.private_copy);
  timings.load_s = loading.seconds();
  if (options.lod.error_px) require_levels(options.input, loaded);
  ChosenCamera camera = choose_camera(*loaded.source, options, globals);
  RenderConfig config = make_config(*loaded.source, camera.camera, options);
  config.lod_layers = outputs.has_lod_layers();
  const MemoryReservation pixels = reserve_picture(options, config, globals.memory);
  const TracerConfig backend = tracer_config(options, globals, loaded.baked.has_value());
  const Traced traced = trace(options, globals, loaded, config, std::move(camera), backend, progress);
  display.finish();
  const RenderedImage& image = traced.image;

  const Stopwatch writing;
  outputs.write(image, {{"comments", std::string("packtrace render")},
                        {"aoRadius", static_cast<double>(config.ao.radius)},
                        {"aoSpp", static_cast<int>(config.ao.spp)},
                        {"frames", static_cast<int>(config.frames)}});
  timings.write_s = writing.seconds();
  std::vector<const RayTracer*> tracers;
  for (const std::unique_ptr<RayTracer>& tracer : traced.tracers) tracers.push_back(tracer.get());
  const SceneSource& source = traced.detail ? *traced.detail->source : *loaded.source;
  nlohmann::json result =
      render_json(options, config, image, source, tracers, traced.camera, traced.detail, outputs.targets(), timings);
  if (loaded.baked) {
    const PrimaryCamera traced_pixels(
        traced.camera.camera, {config.size.width * config.supersample, config.size.height * config.supersample});
    result["seams"] = visible_seams_json(InstanceSeams(*loaded.baked), image, traced_pixels,
                                         camera_uses_lod ? &*traced.detail : nullptr);
  }
  if (!image.seen && !globals.quiet)
    print_printable(options.input + ": warning: this camera sees nothing of the scene; try --camera auto\n", stderr);
  if (!globals.quiet) warn_of_flat_instances(options.input, tracers[0]->flat_instances().size());
  if (json.wanted()) json.write(result);
  if (json.to_stdout() || globals.quiet) return 0;
  std::FILE* const text = outputs.to_stdout() ? stderr : stdout;
  print_render(text, result);
  if (globals.verbosity > 0)
    fmt::print(text, "{}", choices_text(options, globals, traced.camera, config, loaded, *tracers.front(), timings));
  return 0;
}

} // namespace

void add_render_command(CLI::App& app, GlobalOptions& globals) {
  const auto options = std::make_shared<RenderOptions>();
  CLI::App& verb = add_verb(app, globals, "render", "Render denoised ambient occlusion of a .ptk file or a .pbrt scene",
                            [options, &globals] { return run(*options, globals); });
  add_render_options(verb, *options);
}

} // namespace packtrace
