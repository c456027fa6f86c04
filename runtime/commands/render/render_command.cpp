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
#include "runtime/commands/cli/binary_output.h"
#include "runtime/commands/cli/json_output.h"
#include "runtime/commands/cli/progress_display.h"
#include "runtime/commands/render/image_outputs.h"
#include "runtime/commands/render/render_camera.h"
#include "runtime/commands/render/render_options.h"
#include "runtime/commands/render/render_report.h"
#include "runtime/commands/render/render_setup.h"
#include "runtime/commands/render/voxel_render.h"
#include "runtime/commands/reports/seam_report.h"
#include "runtime/commands/sequence/sequence_render.h"
#include "runtime/stopwatch.h"

namespace packtrace {
namespace {

/// Renders the camera, or the whole scene if the scene's own camera sees nothing of it.
PictureReport render_chosen(const RenderOptions& options, const GlobalOptions& globals, const LoadedScene& loaded,
                            FrameLoop& loop, const StillConfig& config, double time_s, ChosenCamera& camera,
                            RenderedImage& image, Progress& progress) {
  return with_file(options.input, [&] {
    const bool may_replace = !options.camera && camera.index;
    PictureReport report = render_still(loop, camera.camera, time_s, config.frames, may_replace, image, progress);
    if (report.seen || !may_replace) return report;
    camera = frame_whole_scene(camera, *loaded.source, config.size, options, globals);
    loop.reset();
    return render_still(loop, camera.camera, time_s, config.frames, false, image, progress);
  });
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
void check_targets(const ImageOutputs& outputs, const JsonOutput& json, const DetailConfig& detail,
                   const RenderOptions& options) {
  refuse_shared_stdout(outputs.to_stdout(), json);
  require_denoiser_for(outputs.layers(), denoises(options));
  require_shading_for(outputs.layers(), options);
  const bool levels = has_lod_layer(outputs.layers());
  if (levels && !detail.error_px) throw Error(ErrorKind::kUsage, "the layers lod and lod-error require --lod-error");
  if (levels && detail.only_occlusion)
    throw Error(ErrorKind::kUsage,
                "the layers lod and lod-error do not work with --lod-rays occlusion, where the camera sees "
                "level 0");
}

int run(const RenderOptions& options, const GlobalOptions& globals) {
  if (views_proxies(options)) return render_proxies(options, globals);
  validate(options.sequence);
  if (options.sequence.path) return render_sequence(options, globals);
  if (options.outputs.empty()) fail_without_output("render", options.input, ".png");
  tracer_config(options, globals, false); // reports wrong options before any work
  if (!options.size.empty()) parse_size(options.size);
  JsonOutput json(globals.json, globals.force);
  const DetailConfig detail = detail_config(options.lod, json.wanted() || globals.verbosity > 0);
  ImageOutputs outputs(options.outputs, options.aovs, available_layers(options, detail), globals.force,
                       preview_style(options)); // reports unwritable files before any work
  check_targets(outputs, json, detail, options);
  ProgressDisplay display(globals);
  Progress progress(display.observer());
  const RenderSetup setup(options, globals, detail, outputs.layers(), progress, display);
  const LoadedScene& loaded = setup.loaded;
  const StillConfig& config = setup.config;
  FrameLoop& loop = *setup.loop;
  ChosenCamera camera = setup.camera;
  FileTimings timings;
  timings.load_s = setup.load_s;
  RenderedImage image;
  const PictureReport report =
      render_chosen(options, globals, loaded, loop, config, setup.time_s, camera, image, progress);
  display.finish();

  const Stopwatch writing;
  outputs.write(image, render_attributes(config, config.frames));
  timings.write_s = writing.seconds();
  const RayTracer& first_tracer = *loop.tracers().front();
  nlohmann::json result = render_json(options, config, image, report, loop, camera, outputs.targets(), timings);
  if (loaded.baked) {
    const PrimaryCamera traced_pixels(camera.camera, config.traced_size());
    result["seams"] = visible_seams_json(InstanceSeams(*loaded.baked), image, traced_pixels,
                                         detail.camera_uses_levels() ? loop.detail() : nullptr);
  }
  if (options.proxy_beyond_px) result["proxies"] = used_proxies_json(config, loop);
  if (!report.seen && !globals.quiet)
    print_printable(options.input + ": warning: this camera sees nothing of the scene; try --camera auto\n", stderr);
  if (!globals.quiet) warn_of_flat_instances(options.input, first_tracer.flat_instances().size());
  if (json.wanted()) json.write(result);
  if (json.to_stdout() || globals.quiet) return 0;
  std::FILE* const text = outputs.to_stdout() ? stderr : stdout;
  print_render(text, result);
  if (result.contains("proxies")) fmt::print(text, "{}", used_proxies_text(result["proxies"]));
  if (globals.verbosity > 0)
    fmt::print(text, "{}", choices_text(options, globals, camera, config, loaded, first_tracer, timings));
  return 0;
}

} // namespace

void add_render_command(CLI::App& app, GlobalOptions& globals) {
  const auto options = std::make_shared<RenderOptions>();
  CLI::App& verb = add_verb(app, globals, "render",
                            "Render denoised ambient occlusion, or a shaded picture, of a .ptk file or a .pbrt scene",
                            [options, &globals] { return run(*options, globals); });
  add_render_options(verb, *options);
}

} // namespace packtrace
