#include "runtime/commands/render/voxel_render.h"

#include <array>
#include <functional>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pbrt_import/base/file_error.h"
#include "runtime/commands/cli/binary_output.h"
#include "runtime/commands/cli/json_output.h"
#include "runtime/commands/cli/option_checks.h"
#include "runtime/commands/cli/progress_display.h"
#include "runtime/commands/render/image_outputs.h"
#include "runtime/commands/render/render_camera.h"
#include "runtime/commands/reports/file_report.h"
#include "runtime/frame/frame_loop.h"
#include "runtime/image/background.h"
#include "runtime/image/png.h"
#include "runtime/stopwatch.h"
#include "runtime/voxels/proxy_tracer.h"
#include "runtime/voxels/voxel_picture.h"

namespace packtrace {
namespace {

constexpr const char *kVoxelView = "voxels", *kFieldView = "sdf";

/// Options that other views have, and that would be ignored here.
void refuse_other_options(const RenderOptions& options) {
  const RenderOptions defaults;
  const AoOptions &ao = options.ao, &ao_defaults = defaults.ao;
  const bool sequence = options.sequence.path || options.sequence.keys || options.sequence.start_time;
  const bool denoiser = options.denoiser != defaults.denoiser || !options.denoiser_settings.empty();
  const std::array<std::pair<const char*, bool>, 17> given = {{
      {"--aov", !options.aovs.empty()},
      {"--ground-truth", options.ground_truth},
      {"--no-legend", options.no_legend},
      {"the denoiser's options", denoiser},
      {"--ao-resolution", ao.resolution != ao_defaults.resolution},
      {"--ao-rate", ao.rate != ao_defaults.rate},
      {"--ao-sampler", ao.sampler != ao_defaults.sampler},
      {"--ao-no-falloff", ao.no_falloff},
      {"--ao-interreflection", ao.interreflection.has_value()},
      {"--ao-set", !ao.settings.empty()},
      {"--backend", options.backend.has_value() || options.gpu_device.has_value()},
      {"--bvh", options.bvh.has_value()},
      {"--fast-edges", options.fast_edges},
      {"--lod-error", options.lod.error_px.has_value()},
      {"--proxy-beyond", options.proxy_beyond_px.has_value()},
      {"--proxy-error", options.proxy_error.has_value()},
      {"--path, --keys and --start-time", sequence},
  }};
  std::vector<std::string> names;
  for (const auto& [name, is_given] : given)
    if (is_given) names.emplace_back(name);
  refuse_without_effect(names, "--view " + options.shade.view);
}

Image picture_of(const VoxelPicture& traced, ImageSize size) {
  Image image(size, 3);
  for (size_t i = 0; i < traced.color.size(); ++i)
    for (size_t c = 0; c < 3; ++c)
      image.data[3 * i + c] = srgb_from_linear(traced.color[i][static_cast<glm::length_t>(c)]);
  return image;
}

/// What to do for a picture of proxies that the input does not have.
[[noreturn]] void fail_without_proxies(const RenderOptions& options, const LoadedScene& loaded,
                                       const VoxelScene* scene) {
  const std::string& view = options.shade.view;
  const bool other = scene != nullptr && !scene->proxies().empty();
  const std::string holds = !loaded.baked ? "only .ptk files have proxies"
                            : other
                                ? "its proxies are " + std::string(view == kFieldView ? "voxels" : "distance fields")
                                : "it has no proxies";
  const std::string source = !loaded.baked ? options.input : "its scene";
  throw FileError(ErrorKind::kUnsupported, options.input,
                  holds + ": bake " + source + " with --proxy " + view +
                      (other ? ", or use --view " + std::string(view == kFieldView ? kVoxelView : kFieldView) : ""));
}

/// The camera of one of a pixel's rays: parts of the pixel (--supersample) in turn, shifted from frame to frame as in
/// other views.
std::function<PrimaryCamera(uint32_t)> pixel_views(const Camera& camera, const StillConfig& still) {
  return [&camera, &still](uint32_t view) {
    const uint32_t n = still.supersample, part = view % (n * n);
    const glm::dvec2 shift = still.jitter ? jitter_offset(view / (n * n)) : glm::dvec2(0.0);
    return PrimaryCamera(camera, still.size,
                         (glm::dvec2(part % n, part / n) + 0.5 + shift) / static_cast<double>(n) - 0.5);
  };
}

struct ProxyPicture {
  const VoxelScene& scene;
  const StillConfig& still;
  const VoxelPicture& traced;
  double seconds;

  double mrays_per_s() const { return static_cast<double>(traced.rays) * 1e-6 / seconds; }
};

nlohmann::json picture_json(const RenderOptions& options, const ProxyPicture& picture) {
  const auto& [scene, still, traced, seconds] = picture;
  return {{"verb", "render"},
          {"view", options.shade.view},
          {"tap_error", traced.field_pixels > 0 ? nlohmann::json(traced.tap_error) : nlohmann::json()},
          {"cone_error", traced.field_pixels > 0 ? nlohmann::json(traced.cone_error) : nlohmann::json()},
          {"input", options.input},
          {"outputs", options.outputs},
          {"width", still.size.width},
          {"height", still.size.height},
          {"frames", still.frames},
          {"supersample", still.supersample},
          {"spp", still.ao.spp},
          {"instances", scene.instance_count()},
          {"instances_without_proxy", scene.instances_without_proxy()},
          {"flat_instances", scene.flat_instances()},
          {"resident_bytes", scene.resident_bytes()},
          {"rays", traced.rays},
          {"trace_s", seconds},
          {"mrays_per_s", picture.mrays_per_s()}};
}

void print_picture(std::FILE* out, const ProxyPicture& picture) {
  const auto& [scene, still, traced, seconds] = picture;
  fmt::print(out, "proxies of {} instances ({} without), {} bytes resident; {} rays in {:.3f} s, {:.2f} Mrays/s\n",
             scene.instance_count(), scene.instances_without_proxy(), scene.resident_bytes(), traced.rays, seconds,
             picture.mrays_per_s());
  if (traced.field_pixels > 0)
    fmt::print(out, "mean difference of visibility from that of the rays: taps {:.3f}, cones {:.3f}\n",
               traced.tap_error, traced.cone_error);
}

} // namespace

bool views_proxies(const RenderOptions& options) {
  return options.shade.view == kVoxelView || options.shade.view == kFieldView;
}

int render_proxies(const RenderOptions& options, const GlobalOptions& globals) {
  if (options.outputs.empty()) fail_without_output("render", options.input, ".png");
  refuse_other_options(options);
  if (options.outputs.size() != 1) throw Error(ErrorKind::kUsage, "--view voxels writes one .png file");
  refuse_foreign_ending(options.outputs.front(), {".png"}, "render --view voxels", {});
  JsonOutput json(globals.json, globals.force);
  BinaryOutput output(options.outputs.front(), globals.force, json);
  ProgressDisplay display(globals);
  Progress progress(display.observer());
  const LoadedScene loaded = load_scene(options.input, options.scene, globals, progress, display, options.private_copy);
  const std::optional<VoxelScene> scene =
      loaded.baked ? std::optional<VoxelScene>(std::in_place, *loaded.baked) : std::nullopt;
  if (!scene || scene->proxies().empty() || scene->proxies().front().is_field() != (options.shade.view == kFieldView))
    fail_without_proxies(options, loaded, scene ? &*scene : nullptr);
  const ChosenCamera chosen = choose_camera(*loaded.source, options, globals);
  const StillConfig still = make_config(*loaded.source, chosen.camera, options, {});
  const MemoryReservation pixels(globals.memory, still.size.pixels() * 64, "a picture");
  VoxelPictureConfig config;
  config.views = still.frames * still.supersample * still.supersample;
  config.samples = still.ao.spp, config.seed = static_cast<uint32_t>(still.ao.seed ^ still.ao.seed >> 32);
  config.radius = static_cast<double>(still.ao.radius);
  progress.begin("tracing proxies", uint64_t{config.views} * still.size.height);
  const Stopwatch tracing;
  const VoxelPicture traced = trace_voxel_picture(*scene, pixel_views(chosen.camera, still), config, progress);
  const double seconds = tracing.seconds();
  const Background background = parse_background(options.background.value_or("c8ccd8"));
  output.write(
      encode_png(over_background(picture_of(traced, still.size), traced.coverage, background), PngTransfer::kRaw));
  display.finish();
  if (!globals.quiet && scene->flat_instances() > 0)
    print_printable(fmt::format("{}: warning: {} instances are not traced: flattened by their transform\n",
                                options.input, scene->flat_instances()),
                    stderr);
  const ProxyPicture picture{*scene, still, traced, seconds};
  if (json.wanted()) json.write(picture_json(options, picture));
  if (!json.to_stdout() && !globals.quiet) print_picture(output.text_stream(), picture);
  return 0;
}

nlohmann::json used_proxies_json(const FrameConfig& config, const FrameLoop& loop) {
  const auto* const proxies = dynamic_cast<const ProxyTracer*>(loop.tracers().back());
  const std::optional<double> error = loop.proxy_error();
  return {{"beyond_px", *config.proxy_beyond_px},
          {"instances", proxies != nullptr ? proxies->proxied().size() : 0},
          {"error", error ? nlohmann::json(*error) : nlohmann::json()},
          {"most_error", config.proxy_error}};
}

std::string used_proxies_text(const nlohmann::json& used) {
  const auto instances = used["instances"].get<size_t>();
  const nlohmann::json& error = used["error"];
  const std::string start = fmt::format("  proxies   occlusion rays see {} instances as voxels: ", instances);
  if (error.is_null()) return start + "none is small, or triangles are faster\n";
  return start + fmt::format("the mean error of ambient occlusion {} {:.4f}, {} --proxy-error {}\n",
                             instances > 0 ? "is" : "would be", error.get<double>(), instances > 0 ? "within" : "above",
                             used["most_error"].get<double>());
}

} // namespace packtrace
