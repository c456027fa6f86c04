#include "runtime/commands/render/render_options.h"

#include <algorithm>

#include "pbrt_import/base/error.h"
#include "runtime/commands/cli/option_checks.h"
#include "runtime/commands/render/denoiser_options.h"
#include "runtime/commands/render/image_outputs.h"
#include "runtime/commands/render/render_camera.h"

namespace packtrace {
namespace {

// Many frames: camera rays are jittered from frame to frame.
constexpr uint32_t kGroundTruthFrames = 256, kGroundTruthSpp = 4;

/// Options for the pictures to write.
void add_picture_options(CLI::App& verb, RenderOptions& options) {
  verb.add_option("-o,--output", options.outputs,
                  "Output image, .png or .exr (required). Repeat the option or separate names by commas to write "
                  "several; - writes a PNG to standard output")
      ->type_name("FILE")
      ->allow_extra_args(false);
  verb.add_option(
          "--aov", options.aovs,
          "Layers to write, separated by commas. ao is denoised, ao_raw is the last frame before denoising, shaded is "
          "albedo times ao; others are depth, normal, instance, albedo (default: these in .exr, ao in .png), the views "
          "hit_distance, motion, previous_depth, local_variance, variance, history and disocclusion, "
          "the surfaces' material_flags and cluster, what camera rays cost: visited_nodes, visited_leaves and "
          "tested_triangles (docs/command_line.md), with --lod-error lod and lod-error, with --view pbr and pbr+ao pbr "
          "(the default in .png), direct and specular, and all but the costs. Several layers in .png become "
          "NAME.LAYER.png")
      ->delimiter(',')
      ->type_name("LAYERS");
  verb.add_option("--background", options.background,
                  "Background of .png files, where no surface is hit. A colour name, rrggbb in hexadecimal digits, "
                  "transparent or sky (default: light grey; sky for albedo and shaded). It does not affect .exr files")
      ->type_name("COLOR");
  verb.add_flag("--no-legend", options.no_legend,
                "Do not add the colour scale below .png files of layers in false colours");
}

/// Options for the number of rays.
void add_frame_options(CLI::App& verb, RenderOptions& options) {
  verb.add_option("--frames", options.frames,
                  "Number of frames to accumulate and denoise, 1..65536 (default 32). More frames give "
                  "less noise and take longer. With --path, the number of pictures")
      ->type_name("N");
  verb.add_flag("--ground-truth", options.ground_truth,
                "Render a reference image without denoiser, in 256 frames of 4 spp unless --frames or --spp are given. "
                "Takes minutes");
}

/// The name of the backend.
/// @param baked whether the input is a .ptk file
std::string choose_backend(const RenderOptions& options, bool baked) {
  const bool needs_embree = options.bvh || options.fast_edges;
  if (options.gpu_device && !options.backend.value_or("gpu").starts_with("gpu"))
    throw Error(ErrorKind::kUsage, "--gpu-device requires --backend gpu or gpu-rt");
  if (options.gpu_device && needs_embree)
    throw Error(ErrorKind::kUsage, "--bvh and --fast-edges require --backend embree, --gpu-device requires gpu");
  if (!options.backend && options.gpu_device) return "gpu";
  if (!options.backend) return baked && !needs_embree ? "packed" : "embree";
  if (*options.backend != "embree" && needs_embree)
    throw Error(ErrorKind::kUsage, "--bvh and --fast-edges require --backend embree");
  return *options.backend;
}

} // namespace

void add_view_options(CLI::App& verb, RenderOptions& options) {
  verb.add_option(
          "--camera", options.camera,
          "Camera number in the scene, from 0, auto for a view of the whole scene, or "
          "[I:]lookat:PX,PY,PZ,LX,LY,LZ[,UX,UY,UZ[,FOV]], which moves camera I, or 0, to a position and lets it "
          "look at a point (default 0, or auto if there is no camera or camera 0 sees nothing)")
      ->type_name("CAMERA");
  verb.add_option("--size", options.size,
                  "Image size in pixels, for example 640x360 (default: the size of the scene's film, or 1280x720 with "
                  "--camera auto)")
      ->type_name("WxH");
  verb.add_option(
          "--supersample", options.supersample,
          "Trace at N times the width and height and filter down, 1..8 (default 1), for smooth edges in few frames. "
          "Time and memory grow with N squared")
      ->type_name("N");
}

void add_quality_options(CLI::App& verb, RenderOptions& options) {
  verb.add_option("--spp", options.spp, "Ambient occlusion rays per pixel and frame, 1..65536 (default 1)")
      ->type_name("N");
  verb.add_flag("--no-jitter", options.no_jitter,
                "Trace camera rays through pixel centres only. By default each frame shifts them within their pixels, "
                "so that edges become smooth");
  add_denoiser_options(verb, options.denoiser, options.denoiser_settings);
  add_ao_options(verb, options.ao);
  verb.add_flag("--private-copy", options.private_copy,
                "Read a .ptk file into memory instead of mapping it, so that it may be changed or deleted meanwhile");
  verb.add_option("--seed", options.seed, "Seed of the sample pattern (default 0). Another seed gives other noise")
      ->type_name("N");
}

void add_tracer_options(CLI::App& verb, RenderOptions& options) {
  verb.add_option(
          "--backend", options.backend,
          "Ray tracer to use. packed traces the compressed clusters (default for .ptk files); gpu does the same on a "
          "GPU with Vulkan and finds the same hits; gpu-rt lets the GPU's driver trace decoded triangles in its own "
          "acceleration structures, which take 3 to 12 times the memory; embree traces floats (default for .pbrt "
          "scenes, and with --bvh or --fast-edges)")
      ->check(one_of({"packed", "gpu", "gpu-rt", "embree"}));
  verb.add_option(
          "--gpu-device", options.gpu_device,
          "Part of the name of the Vulkan device to use, in any case; selects --backend gpu unless gpu-rt is chosen "
          "(default: a discrete GPU, else another GPU). Devices that run on the CPU, such as llvmpipe, are used by "
          "name only")
      ->type_name("NAME");
  verb.add_option(
          "--bvh,--bvh-quality", options.bvh,
          "Quality of Embree's BVH; selects --backend embree (default medium). high takes longer to build; it traces "
          "faster together with --fast-edges")
      ->check(one_of({"medium", "high"}));
  verb.add_flag(
      "--fast-edges", options.fast_edges,
      "Use Embree's faster, non-watertight intersection tests; selects --backend embree. Tracing is up to 20 % faster, "
      "but a few rays slip through between adjacent triangles");
}

void add_render_options(CLI::App& verb, RenderOptions& options) {
  verb.add_option("FILE", options.input,
                  ".ptk file, or a .pbrt scene or mesh file, which is traced as floats without compression")
      ->required();
  add_picture_options(verb, options);
  add_view_options(verb, options);
  add_frame_options(verb, options);
  add_quality_options(verb, options);
  add_shade_options(verb, options.shade);
  add_tracer_options(verb, options);
  add_lod_options(verb, options.lod);
  verb.add_option(
          "--proxy-beyond", options.proxy_beyond_px,
          "Occlusion rays see instances smaller than so many pixels as their voxels where that makes rays faster: "
          "if they have many triangles, and enough of the picture shows them, and the error allows it "
          "(--proxy-error). For .ptk files baked with --proxy voxels, best with --proxy-surface matched")
      ->type_name("PX")
      ->group("Levels of detail");
  verb.add_option("--proxy-error", options.proxy_error,
                  "Largest mean error of ambient occlusion with which voxels are used, 0..1 (default 0.01). It is "
                  "measured at 256 pixels before")
      ->type_name("E")
      ->group("Levels of detail");
  add_sequence_options(verb, options.sequence);
  add_scene_options(verb, options.scene);
  verb.footer("The image is the mean of --frames frames of --spp rays per pixel, denoised over time\n"
              "and space. -v prints the chosen camera, radius, backend and grid with the reasons.\n"
              "Examples:\n"
              "  packtrace render house.ptk -o house.png\n"
              "  packtrace render house.ptk -o house.png,house.exr --aov all --frames 256\n"
              "  packtrace render house.ptk -o - --background transparent | display\n"
              "  packtrace render forest.ptk -o forest.png --lod-error 1 --aov ao,lod\n"
              "  packtrace render house.ptk -o house.png --view pbr+ao --tone-map aces\n"
              "  packtrace render scene.pbrt -o truth.exr --ground-truth --frames 256\n"
              "  packtrace render house.ptk --path orbit:90 --frames 96 -o 'frame_%04d.png'\n"
              "  packtrace render house.ptk --path turntable -o - --stream y4m | ffmpeg -i - turn.mp4");
}

bool denoises(const RenderOptions& options) { return !options.ground_truth && options.denoiser != "off"; }

void require_denoiser_for(const std::vector<std::string>& layers, bool denoise) {
  if (!denoise && has_denoiser_layer(layers))
    throw Error(ErrorKind::kUsage, "the layers variance, history and disocclusion require a denoiser");
}

void require_shading_for(const std::vector<std::string>& layers, const RenderOptions& options) {
  if (!options.shade.shades() && has_shaded_layer(layers))
    throw Error(ErrorKind::kUsage, "the layers pbr, direct and specular require --view pbr or pbr+ao");
}

AvailableLayers available_layers(const RenderOptions& options, const DetailConfig& detail) {
  AvailableLayers layers{detail.camera_uses_levels(), denoises(options)};
  layers.shaded = options.shade.shades();
  return layers;
}

FrameConfig frame_config(const RenderOptions& options, const DetailConfig& detail) {
  FrameConfig config;
  config.supersample = options.supersample;
  config.denoise = denoises(options);
  config.denoiser = denoiser_config(options.denoiser, options.denoiser_settings);
  config.ao.spp = options.spp.value_or(options.ground_truth ? kGroundTruthSpp : 1);
  apply(options.ao, config);
  apply(options.shade, config);
  if (options.ground_truth && (config.ao_resolution != AoResolution::kFull || config.ao_rate != AoRate::kFull))
    throw Error(ErrorKind::kUsage,
                "--ground-truth needs all pixels; it does not go with --ao-resolution quarter or --ao-rate");
  config.jitter = !options.no_jitter;
  config.detail = detail;
  config.ao.seed = options.seed;
  validate(config.ao);
  return config;
}

StillConfig make_config(const SceneSource& source, const Camera& camera, const RenderOptions& options,
                        const DetailConfig& detail) {
  StillConfig config;
  static_cast<FrameConfig&>(config) = frame_config(options, detail);
  config.size = options.size.empty() ? ImageSize{camera.width_px, camera.height_px} : parse_size(options.size);
  // A sequence has its own numbers of pictures and frames.
  const uint64_t frames = options.frames.value_or(options.ground_truth ? kGroundTruthFrames : 32);
  config.frames = options.sequence.path ? 1 : static_cast<uint32_t>(std::min<uint64_t>(frames, ~0u));
  config.proxy_beyond_px = options.proxy_beyond_px;
  if (options.proxy_error && !options.proxy_beyond_px)
    throw Error(ErrorKind::kUsage, "--proxy-error requires --proxy-beyond");
  config.proxy_error = options.proxy_error.value_or(config.proxy_error);
  config.validate();
  config.ao.radius = ao_radius(config.ao, source.world_bounds());
  return config;
}

TracerConfig tracer_config(const RenderOptions& options, const GlobalOptions& globals, bool baked) {
  TracerConfig config;
  set_backend(config, choose_backend(options, baked)); // the option's check accepts only known names
  const std::string quality = options.bvh.value_or("medium");
  config.embree = {quality == "high" ? BvhQuality::kHigh : BvhQuality::kMedium, !options.fast_edges, false, true,
                   globals.memory};
  config.gpu.device = options.gpu_device.value_or("");
  return config;
}

PreviewStyle preview_style(const RenderOptions& options) {
  PreviewStyle style;
  if (options.background) style.background = parse_background(*options.background);
  style.legend = !options.no_legend;
  style.exposure = exposure(options.shade);
  return style;
}

} // namespace packtrace
