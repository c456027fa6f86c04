#include "runtime/commands/commands.h"

#include <charconv>
#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/with_file.h"
#include "pbrt_import/scene/camera_rays.h"
#include "runtime/commands/binary_output.h"
#include "runtime/commands/cli_support.h"
#include "runtime/commands/image_outputs.h"
#include "runtime/commands/json_output.h"
#include "runtime/commands/loaded_scene.h"
#include "runtime/commands/lod_render.h"
#include "runtime/commands/option_checks.h"
#include "runtime/commands/process_usage.h"
#include "runtime/commands/progress_display.h"
#include "runtime/commands/render_choices.h"
#include "runtime/commands/seam_report.h"
#include "runtime/render/renderer.h"
#include "runtime/stopwatch.h"
#include "runtime/trace/make_tracer.h"

namespace packtrace {
namespace {

constexpr ImageSize kDefaultSize{1280, 720};
constexpr uint32_t kGroundTruthSpp = 1024;

struct RenderOptions {
  std::string input;
  std::vector<std::string> outputs, aovs;
  std::optional<std::string> camera; ///< number or "auto"; if not set, camera 0, or "auto" if that sees nothing
  std::string size;
  std::optional<std::string> background; ///< background of .png files; if not set, it depends on the layer
  bool no_legend = false;
  bool private_copy = false;
  uint32_t supersample = 1;
  std::optional<uint32_t> spp, frames;
  bool ground_truth = false, no_denoise = false, fast_edges = false;
  SceneOptions scene;
  std::optional<float> ao_radius;
  bool ao_falloff_off = false;
  float ao_interreflection = 0.0f;
  uint64_t seed = 0;
  std::optional<std::string> backend; ///< if not set, the input decides
  std::optional<std::string> bvh;
  LodOptions lod;
};

bool parse_number(std::string_view digits, uint32_t& value) {
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  return error == std::errc() && end == digits.data() + digits.size();
}

ImageSize parse_size(const std::string& text) {
  ImageSize size;
  const size_t cross = text.find_first_of("xX,");
  if (cross == std::string::npos || !parse_number(std::string_view(text).substr(0, cross), size.width) ||
      !parse_number(std::string_view(text).substr(cross + 1), size.height))
    throw Error(ErrorKind::kUsage, "--size " + text + ": write WIDTHxHEIGHT, for example 1280x720");
  return size;
}

/// The camera of a render.
struct ChosenCamera {
  Camera camera;
  std::optional<uint32_t> index; ///< index in the scene's cameras; not set if the camera frames the whole scene
  std::string reason;            ///< why the scene is framed although --camera auto was not given; else empty
};

ChosenCamera choose_camera(const SceneSource& source, const RenderOptions& options, const GlobalOptions& globals) {
  const std::span<const Camera> cameras = source.cameras();
  const ImageSize size = options.size.empty() ? kDefaultSize : parse_size(options.size);
  const std::string name = options.camera.value_or("0");
  if (name == "auto") return {framing_camera(source.world_bounds(), size), std::nullopt, {}};
  uint32_t index = 0;
  if (!parse_number(name, index))
    throw Error(ErrorKind::kUsage, "--camera " + name + ": must be a camera number, from 0, or auto");
  if (index < cameras.size()) return {cameras[index], index, {}};
  if (index > 0)
    throw Error(ErrorKind::kUsage, fmt::format("--camera {}: the scene has {} camera{}", index, cameras.size(),
                                               cameras.size() == 1 ? "" : "s"));
  if (!globals.quiet)
    print_printable(options.input + ": warning: the scene has no camera; showing the whole scene\n", stderr);
  return {framing_camera(source.world_bounds(), size), std::nullopt, "the scene has no camera"};
}

/// Returns a camera that frames the whole scene, to replace a camera that sees nothing of it. Prints a warning.
ChosenCamera frame_whole_scene(const ChosenCamera& blind, const SceneSource& source, ImageSize size,
                               const RenderOptions& options, const GlobalOptions& globals) {
  ChosenCamera framing{framing_camera(source.world_bounds(), size), std::nullopt,
                       fmt::format("camera {} sees nothing", blind.index.value())};
  if (!globals.quiet)
    print_printable(
        fmt::format("{}: warning: {} of the scene; showing the whole scene (--camera {} keeps the camera)\n",
                    options.input, framing.reason, *blind.index),
        stderr);
  return framing;
}

/// Collects the reasons for the settings of a render, for -v.
RenderChoices reasons(const SceneSource& source, const ChosenCamera& camera, const RenderOptions& options, bool baked,
                      const GlobalOptions& globals) {
  const size_t cameras = source.cameras().size();
  RenderChoices choices;
  choices.camera = camera.camera;
  choices.camera_reason = options.camera == "auto" ? "--camera auto, which shows the whole scene"
                          : !camera.reason.empty()
                              ? camera.reason + ", so the whole scene is shown"
                              : fmt::format("number {} of {}, counted from 0{}", camera.index.value_or(0), cameras,
                                            camera.index == 0u && cameras > 1 ? "; --camera selects another" : "");
  choices.size_reason = options.size.empty() ? (camera.index ? "the camera's film" : "the default") : "--size";
  choices.radius_reason = options.ao_radius ? "--ao-radius"
                                            : fmt::format("10 % of the scene's diagonal, {:.5g}",
                                                          glm::length(source.world_bounds().extent()));
  choices.backend_reason = options.backend ? "--backend"
                           : !baked        ? "default for .pbrt scenes, which are traced as floats"
                           : options.bvh || options.fast_edges
                               ? "--bvh and --fast-edges select Embree"
                               : "default for .ptk files, which are traced as packed clusters";
  choices.threads_reason = globals.threads > 0         ? "--threads"
                           : thread_limit(globals) > 0 ? "PACKTRACE_THREADS"
                                                       : "all hardware threads";
  return choices;
}

RenderConfig make_config(const SceneSource& source, const Camera& camera, const RenderOptions& options) {
  RenderConfig config;
  config.size = options.size.empty() ? ImageSize{camera.width_px, camera.height_px} : parse_size(options.size);
  config.supersample = options.supersample;
  config.denoise = !options.no_denoise && !options.ground_truth;
  config.frames = options.frames.value_or(options.ground_truth ? 1 : 32);
  config.ao.spp = options.spp.value_or(options.ground_truth ? kGroundTruthSpp : 1);
  config.ao.radius = options.ao_radius.value_or(default_ao_radius(source.world_bounds()));
  config.ao.falloff = !options.ao_falloff_off;
  config.ao.interreflection = options.ao_interreflection;
  config.ao.seed = options.seed;
  validate(config);
  validate(config.ao);
  return config;
}

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

/// @param baked whether the input is a .ptk file
Backend choose_backend(const RenderOptions& options, bool baked) {
  const bool needs_embree = options.bvh || options.fast_edges;
  if (!options.backend) return baked && !needs_embree ? Backend::kPacked : Backend::kEmbree;
  const std::string& name = *options.backend; // the option's check accepts only known names
  if (name == "embree") return Backend::kEmbree;
  if (needs_embree) throw Error(ErrorKind::kUsage, "--bvh and --fast-edges require --backend embree");
  return Backend::kPacked;
}

TracerConfig tracer_config(const RenderOptions& options, const GlobalOptions& globals, bool baked) {
  TracerConfig config;
  config.backend = choose_backend(options, baked);
  const std::string quality = options.bvh.value_or("medium");
  config.embree = {quality == "high" ? BvhQuality::kHigh : BvhQuality::kMedium, !options.fast_edges, false, true,
                   globals.memory};
  return config;
}

double mean_of_valid(const std::vector<float>& ao) {
  double sum = 0;
  uint64_t count = 0;
  for (const float value : ao)
    if (value >= 0) sum += static_cast<double>(value), ++count;
  return count ? sum / static_cast<double>(count) : 0;
}

double rate_m(uint64_t rays, double seconds) { return seconds > 0 ? static_cast<double>(rays) / seconds * 1e-6 : 0; }

/// Resident bytes by name, summed over tracers. Shared parts (the file, the threads' caches) count once.
nlohmann::json resident_parts(std::span<const RayTracer* const> tracers) {
  nlohmann::json parts = nlohmann::json::object();
  for (const RayTracer* tracer : tracers)
    for (const ResidentPart& part : tracer->resident()) {
      const std::string name(part.name);
      parts[name] = part.bytes + (part.shared ? 0 : parts.value(name, uint64_t{0}));
    }
  return parts;
}

uint64_t sum_of(const nlohmann::json& parts) {
  uint64_t bytes = 0;
  for (const auto& [name, part] : parts.items()) bytes += part.get<uint64_t>();
  return bytes;
}

nlohmann::json report(const RenderOptions& options, const RenderConfig& config, const RenderedImage& image,
                      const SceneSource& source, std::span<const RayTracer* const> tracers, const ChosenCamera& camera,
                      const std::optional<ChosenDetail>& detail, const std::vector<std::string>& files) {
  const RayTracer& tracer = *tracers.back();
  const auto hits =
      std::count_if(image.instance.begin(), image.instance.end(), [](uint32_t i) { return i != kNoInstance; });
  const RenderTimings& t = image.timings;
  const nlohmann::json parts = resident_parts(tracers);
  nlohmann::json result = {
      {"verb", "render"},
      {"input", options.input},
      {"backend", tracer.name()},
      {"isa", tracer.isa()},
      {"files", files},
      {"camera",
       {{"index", camera.index ? nlohmann::json(*camera.index) : nlohmann::json()},
        {"frames_scene", !camera.index},
        {"reason", camera.reason.empty() ? nlohmann::json() : nlohmann::json(camera.reason)}}},
      {"width", image.size.width},
      {"height", image.size.height},
      {"supersample", config.supersample},
      {"frames", config.frames},
      {"spp", config.ao.spp},
      {"denoise", config.denoise},
      {"ao_radius", config.ao.radius},
      {"ao_falloff", config.ao.falloff},
      {"seed", config.ao.seed},
      {"hit_pixels", hits},
      {"mean_ao", mean_of_valid(image.ao)},
      {"rays", {{"primary", image.primary_rays}, {"ao", image.ao_rays}}},
      {"mrays_per_s", {{"primary", rate_m(image.primary_rays, t.primary_s)}, {"ao", rate_m(image.ao_rays, t.ao_s)}}},
      {"seconds", {{"bvh", t.build_s}, {"primary", t.primary_s}, {"ao", t.ao_s}, {"denoise", t.denoise_s}}},
      {"resident_bytes",
       {{"source", source.resident_bytes()},
        {"tracing", sum_of(parts)},
        {"bvh", parts.value("bvh", uint64_t{0})},
        {"parts", parts}}},
      {"peak_rss_bytes", peak_rss_bytes()},
  };
  if (detail) result["lod"] = detail_json(*detail, tracer);
  return result;
}

std::string resident_text(const nlohmann::json& resident) {
  const auto mib = [](const nlohmann::json& bytes) { return bytes.get<double>() / (1 << 20); };
  std::string text = fmt::format("{:.1f} MiB", mib(resident.at("tracing")));
  const char* separator = " (";
  for (const auto& [name, bytes] : resident.at("parts").items()) {
    text += fmt::format("{}{} {:.1f}", separator, name, mib(bytes));
    separator = ", ";
  }
  return text + ")";
}

void print(std::FILE* stream, const nlohmann::json& r) {
  const auto& seconds = r.at("seconds");
  const auto frames = r.at("frames").get<double>();
  fmt::print(stream, "{}x{} pixels, {} frame{} of {} spp, mean ao {:.4f}\n", r.at("width").get<int>(),
             r.at("height").get<int>(), r.at("frames").get<int>(), frames == 1 ? "" : "s", r.at("spp").get<int>(),
             r.at("mean_ao").get<double>());
  fmt::print(stream, "  bvh       {:8.3f} s   {}, {}; {} resident\n", seconds.at("bvh").get<double>(),
             r.at("backend").get<std::string>(), r.at("isa").get<std::string>(), resident_text(r.at("resident_bytes")));
  fmt::print(stream, "  primary   {:8.3f} s   {:.1f} Mrays/s\n", seconds.at("primary").get<double>(),
             r.at("mrays_per_s").at("primary").get<double>());
  fmt::print(stream, "  ao        {:8.3f} s   {:.1f} Mrays/s\n", seconds.at("ao").get<double>(),
             r.at("mrays_per_s").at("ao").get<double>());
  if (r.at("denoise").get<bool>())
    fmt::print(stream, "  denoise   {:8.3f} s   {:.1f} ms per frame\n", seconds.at("denoise").get<double>(),
               seconds.at("denoise").get<double>() * 1e3 / frames);
  if (r.contains("lod")) fmt::print(stream, "{}", detail_text(r.at("lod")));
  if (r.contains("seams")) fmt::print(stream, "{}", visible_seams_text(r.at("seams")));
  if (const auto& reason = r.at("camera").at("reason"); !reason.is_null())
    fmt::print(stream, "{}: the image shows the whole scene\n", reason.get<std::string>());
  for (const auto& file : r.at("files")) print_printable("wrote " + file.get<std::string>() + "\n", stream);
}

/// A rendered view and the objects it was traced with.
struct Traced {
  ChosenCamera camera;
  std::optional<ChosenDetail> detail;
  std::vector<std::unique_ptr<RayTracer>> tracers; ///< the camera's; with --lod-rays occlusion also the occlusion rays'
  RenderedImage image;
};

Traced trace(const RenderOptions& options, const GlobalOptions& globals, const LoadedScene& loaded, RenderConfig config,
             ChosenCamera chosen, const TracerConfig& backend, bool has_lod_layers, Progress& progress) {
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
  if (camera_uses_lod && has_lod_layers) config.lod_error_px = *options.lod.error_px;
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

PreviewStyle preview_style(const RenderOptions& options) {
  PreviewStyle style;
  if (options.background) style.background = parse_background(*options.background);
  style.legend = !options.no_legend;
  return style;
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

int run(const RenderOptions& options, const GlobalOptions& globals) {
  if (options.outputs.empty()) fail_without_output("render", options.input, ".png");
  tracer_config(options, globals, false); // reports wrong options before any work
  if (!options.size.empty()) parse_size(options.size);
  validate(options.lod);
  JsonOutput json(globals.json, globals.force);
  const bool camera_uses_lod = options.lod.error_px && !options.lod.only_occlusion();
  ImageOutputs outputs(options.outputs, options.aovs, camera_uses_lod, globals.force,
                       preview_style(options)); // reports unwritable files before any work
  if (outputs.to_stdout() && json.to_stdout())
    throw Error(ErrorKind::kUsage, "-o - and --json - would both write to standard output; use a file for one of them");
  if (outputs.has_lod_layers() && !options.lod.error_px)
    throw Error(ErrorKind::kUsage, "the layers lod and lod-error require --lod-error");
  if (outputs.has_lod_layers() && !camera_uses_lod)
    throw Error(ErrorKind::kUsage,
                "the layers lod and lod-error do not work with --lod-rays occlusion, where the camera sees "
                "level 0");
  ProgressDisplay display(globals);
  Progress progress(display.observer());
  FileTimings timings;
  const Stopwatch loading;
  const LoadedScene loaded = load_scene(options.input, options.scene, globals, progress, display, options.private_copy);
  timings.load_s = loading.seconds();
  if (options.lod.error_px) require_levels(options.input, loaded);
  ChosenCamera camera = choose_camera(*loaded.source, options, globals);
  const RenderConfig config = make_config(*loaded.source, camera.camera, options);
  const MemoryReservation pixels = reserve_picture(options, config, globals.memory);
  const TracerConfig backend = tracer_config(options, globals, loaded.baked.has_value());
  const Traced traced =
      trace(options, globals, loaded, config, std::move(camera), backend, outputs.has_lod_layers(), progress);
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
      report(options, config, image, source, tracers, traced.camera, traced.detail, outputs.targets());
  result["seconds"]["load"] = timings.load_s;
  result["seconds"]["write"] = timings.write_s;
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
  print(text, result);
  if (globals.verbosity > 0)
    fmt::print(text, "{}",
               choices_text(reasons(*loaded.source, traced.camera, options, loaded.baked.has_value(), globals), config,
                            loaded, *tracers.front(), timings));
  return 0;
}

} // namespace

void add_render_command(CLI::App& app, GlobalOptions& globals) {
  const auto options = std::make_shared<RenderOptions>();
  CLI::App& verb = add_verb(app, globals, "render", "Render denoised ambient occlusion of a .ptk file or a .pbrt scene",
                            [options, &globals] { return run(*options, globals); });
  verb.add_option("FILE", options->input, ".ptk file, or .pbrt scene, which is traced as floats without compression")
      ->required();
  verb.add_option("-o,--output", options->outputs,
                  "Output image, .png or .exr (required). Repeat the option or separate names by commas to write "
                  "several; - writes a PNG to standard output")
      ->type_name("FILE")
      ->allow_extra_args(false);
  verb.add_option(
          "--aov", options->aovs,
          "Layers to write, separated by commas. ao is denoised, ao_raw is the last frame before denoising, shaded is "
          "albedo times ao; others are depth, normal, instance, albedo, with --lod-error lod and lod-error, and all "
          "(default: all in .exr, ao in .png). Several layers in .png become NAME.LAYER.png")
      ->delimiter(',')
      ->type_name("LAYERS");
  verb.add_option("--camera", options->camera,
                  "Camera number in the scene, from 0, or auto for a view of the whole scene (default 0, or auto if "
                  "there is no "
                  "camera or camera 0 sees nothing)")
      ->type_name("I|auto");
  verb.add_option("--size", options->size,
                  "Image size in pixels, for example 640x360 (default: the size of the scene's film, or 1280x720 with "
                  "--camera auto)")
      ->type_name("WxH");
  verb.add_option("--background", options->background,
                  "Background of .png files, where no surface is hit. A colour name, rrggbb in hexadecimal digits, "
                  "transparent or sky (default: light grey; sky for albedo and shaded). It does not affect .exr files")
      ->type_name("COLOR");
  verb.add_flag("--no-legend", options->no_legend,
                "Do not add the colour scale below .png files of depth, lod and lod-error");
  verb.add_option("--supersample", options->supersample,
                  "Trace at N times the width and height and filter down, for smooth edges, 1..8 (default 1). Time and "
                  "memory grow with N squared")
      ->type_name("N");
  verb.add_option("--frames", options->frames,
                  "Number of frames to accumulate and denoise, 1..65536 (default 32). More frames give "
                  "less noise and take longer")
      ->type_name("N");
  verb.add_option("--spp", options->spp, "Ambient occlusion rays per pixel and frame, 1..65536 (default 1)")
      ->type_name("N");
  verb.add_flag("--ground-truth", options->ground_truth,
                "Render a reference image without denoiser, in 1 frame of 1024 spp unless --frames or --spp are given. "
                "Takes minutes");
  verb.add_flag("--no-denoise", options->no_denoise, "Average the frames without denoising");
  verb.add_option(
          "--ao-radius", options->ao_radius,
          "Distance up to which surfaces occlude, in world units (default: 10 % of the scene's diagonal). Small "
          "radii darken creases only, large ones whole rooms")
      ->type_name("R");
  verb.add_flag("--ao-no-falloff", options->ao_falloff_off,
                "Let every hit within the radius occlude fully, instead of fading with its distance");
  verb.add_option("--ao-interreflection", options->ao_interreflection,
                  "Fraction of light that occluding surfaces reflect, 0..1 (default 0, off). Brightens creases between "
                  "light surfaces")
      ->type_name("RHO");
  verb.add_flag("--private-copy", options->private_copy,
                "Read a .ptk file into memory instead of mapping it, so that it may be changed or deleted meanwhile");
  verb.add_option("--seed", options->seed, "Seed of the sample pattern (default 0). Another seed gives other noise")
      ->type_name("N");
  verb.add_option(
          "--backend", options->backend,
          "Ray tracer to use. packed traces the compressed clusters (default for .ptk files); embree traces floats "
          "(default for .pbrt scenes, and with --bvh or --fast-edges)")
      ->check(one_of({"packed", "embree"}));
  verb.add_option(
          "--bvh,--bvh-quality", options->bvh,
          "Quality of Embree's BVH; selects --backend embree (default medium). high takes longer to build; it traces "
          "faster together with --fast-edges")
      ->check(one_of({"medium", "high"}));
  verb.add_flag(
      "--fast-edges", options->fast_edges,
      "Use Embree's faster, non-watertight intersection tests; selects --backend embree. Tracing is up to 20 % faster, "
      "but a few rays slip through between adjacent triangles");
  add_lod_options(verb, options->lod);
  add_scene_options(verb, options->scene);
  verb.footer("The image is the mean of --frames frames of --spp rays per pixel, denoised over time\n"
              "and space. -v prints the chosen camera, radius, backend and grid with the reasons.\n"
              "Examples:\n"
              "  packtrace render house.ptk -o house.png\n"
              "  packtrace render house.ptk -o house.png,house.exr --aov all --supersample 2\n"
              "  packtrace render house.ptk -o - --background transparent | display\n"
              "  packtrace render forest.ptk -o forest.png --lod-error 1 --aov ao,lod\n"
              "  packtrace render scene.pbrt -o truth.exr --ground-truth --spp 1024");
}

} // namespace packtrace
