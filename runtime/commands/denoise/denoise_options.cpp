#include "runtime/commands/denoise/denoise_options.h"

#include <charconv>

#include <fmt/format.h>

#include "pbrt_import/base/error.h"
#include "runtime/commands/cli/option_checks.h"
#include "runtime/commands/render/denoiser_options.h"

namespace packtrace {
namespace {

constexpr const char* kLayerGroup = "Layers of the input";
constexpr const char* kSequenceGroup = "Sequences";

std::string help_of(const LayerRoleInfo& role) {
  return fmt::format("{}{} (default: {})", role.help, role.required ? "" : "; none leaves it out",
                     role.required ? "a layer with a usual name" : "a layer with a usual name, if there is one");
}

void add_layer_options(CLI::App& verb, DenoiseOptions& options) {
  for (size_t i = 0; i < kLayerRoleCount; ++i)
    verb.add_option(layer_roles()[i].option, options.layers[i], help_of(layer_roles()[i]))
        ->type_name("LAYER")
        ->group(kLayerGroup);
  verb.add_option("--depth-kind", options.depth_kind,
                  "What depths measure: z along the camera's axis, distance along its rays, which requires --fov "
                  "(default z)")
      ->check(one_of({"z", "distance"}))
      ->default_str(options.depth_kind)
      ->group(kLayerGroup);
  verb.add_option("--fov", options.fov, "Field of view of the camera across the shorter image axis, in degrees")
      ->type_name("DEG")
      ->group(kLayerGroup);
  verb.add_option("--far", options.far_depth, "Depth from which on there is background (default 1e9)")
      ->type_name("Z")
      ->group(kLayerGroup);
  verb.add_flag("--ao-inverted", options.inverted_ao, "1 means fully occluded in the input, and in a copy of it")
      ->group(kLayerGroup);
  verb.add_flag("--normals-unsigned", options.unsigned_normals, "Normals are stored as 0.5 + 0.5 n")
      ->group(kLayerGroup);
  verb.add_option("--motion-scale", options.motion_scale,
                  "Factors that turn the motion layer into pixels, x right, y down, from the previous picture to this "
                  "one (default 1,1; -1,1 for Blender's Vector). -W,-H for a picture of W x H pixels if it holds "
                  "fractions of the picture towards the previous one")
      ->type_name("X,Y")
      ->group(kLayerGroup);
}

void add_sequence_input_options(CLI::App& verb, DenoiseOptions& options) {
  verb.add_option("--start", options.start, "Number of the first picture (default: the first file, or 0)")
      ->type_name("N")
      ->group(kSequenceGroup);
  verb.add_option("--frames", options.frames,
                  "Number of pictures of a numbered sequence (default: up to the last file)")
      ->type_name("N")
      ->group(kSequenceGroup);
  verb.add_option("--cut", options.cuts,
                  "Numbers of pictures that begin a new shot, separated by commas: history ends there. It also ends "
                  "where less than a tenth of the surfaces were in the picture before")
      ->delimiter(',')
      ->type_name("N")
      ->group(kSequenceGroup);
  CLI::Option* const still =
      verb.add_flag("--still", options.still,
                    "All pictures show the same view, with camera rays jittered within their pixels: histories stay in "
                    "their pixels. An output name without a number gets the last picture")
          ->group(kSequenceGroup);
  verb.add_flag("--stratified", options.stratified,
                "The samples of a pixel are stratified over the pictures, as those of render are, not independent. "
                "With the wrong choice detail is lost, or noise stays")
      ->group(kSequenceGroup);
  verb.add_option(
          "--samples", options.samples,
          "Number of samples of each pixel of a picture, 1..65536 (default 1). What the pictures of few samples "
          "have as noise, those of many have as detail. Not with --still: its pictures show their noise by their "
          "differences")
      ->check(number_in(1, 65536))
      ->excludes(still)
      ->type_name("N")
      ->group(kSequenceGroup);
}

Vec2 parse_scale(const std::string& text) {
  Vec2 scale(0);
  const char* const end = text.data() + text.size();
  const auto [comma, first_error] = std::from_chars(text.data(), end, scale.x);
  if (first_error == std::errc() && comma != end && *comma == ',')
    if (const auto [stop, error] = std::from_chars(comma + 1, end, scale.y); error == std::errc() && stop == end)
      return scale;
  throw Error(ErrorKind::kUsage, "--motion-scale " + text + ": must be two numbers, for example -1,1");
}

} // namespace

void add_denoise_options(CLI::App& verb, DenoiseOptions& options) {
  verb.add_option("FILE", options.inputs,
                  "EXR picture with layers for ambient occlusion, depth and normal, and if it has them motion, albedo "
                  "and object numbers; several, or a name such as in_%04d.exr, are a sequence")
      ->required();
  verb.add_option("-o,--output", options.outputs,
                  "Output image, .exr or .png (required). Repeat the option or separate names by commas to write "
                  "several; sequences need a number, such as out_%04d.exr")
      ->type_name("FILE")
      ->allow_extra_args(false);
  verb.add_option("--aov", options.aovs,
                  "Layers to write, separated by commas: input (all channels of the input, in which the denoised "
                  "occlusion replaces the noisy one), and those of render except lod and lod-error (default: input "
                  "in .exr, ao in .png)")
      ->delimiter(',')
      ->type_name("LAYERS");
  verb.add_option("--background", options.background, "Background of .png files, as of render")->type_name("COLOR");
  verb.add_flag("--no-legend", options.no_legend, "Do not add colour scales below .png files");
  add_denoiser_options(verb, options.denoiser, options.denoiser_settings);
  add_layer_options(verb, options);
  add_sequence_input_options(verb, options);
  verb.footer(denoiser_settings_help() +
              "A LAYER is a layer of the file (ViewLayer.Normal, or just normal), or channels separated by\n"
              "commas (nx,ny,nz). -v prints which were found.\n"
              "Examples:\n"
              "  packtrace denoise in.exr -o out.exr\n"
              "  packtrace denoise in.exr -o out.exr --ao occ --normal nx,ny,nz --depth-kind distance --fov 40\n"
              "  packtrace denoise 'in_%04d.exr' -o 'out_%04d.exr' --cut 120,260\n"
              "  packtrace denoise 'in_%04d.exr' -o 'out_%04d.png' --aov shaded --motion-scale -1280,-720");
}

LayeredConfig layered_config(const DenoiseOptions& options) {
  LayeredConfig config;
  config.denoise = options.denoiser != "off";
  config.denoiser = denoiser_config(options.denoiser, options.denoiser_settings);
  config.still = options.still;
  config.stratified = options.stratified;
  config.samples = options.samples;
  LayeredReading& reading = config.reading;
  reading.layers = options.layers;
  reading.raw_ao = options.still;
  LayerConventions& conventions = reading.conventions;
  conventions.ray_distance = options.depth_kind == "distance";
  conventions.fov_degrees = options.fov;
  if (options.far_depth) conventions.far_depth = *options.far_depth;
  conventions.inverted_ao = options.inverted_ao;
  conventions.unsigned_normals = options.unsigned_normals;
  if (options.motion_scale) conventions.motion_scale = parse_scale(*options.motion_scale);
  conventions.validate();
  return config;
}

} // namespace packtrace
