#include "runtime/commands/bake/bake_options.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "pbrt_import/base/error.h"
#include "pbrt_import/scene_format.h"
#include "runtime/commands/cli/cli_support.h"
#include "runtime/commands/cli/option_checks.h"

namespace packtrace {
namespace {

constexpr const char *kAuto = "auto", *kNoTextures = "none";
constexpr std::array<const char*, baked::kPurposeCount> kPurposes{"ao", "shading"};
constexpr const char* kKeepNormals = "normals";
constexpr const char* kKeepUvs = "uv";
constexpr std::array<const char*, 3> kLodUses{"off", "instanced", "all"}; // indexed by LodUse
constexpr const char* kLodDefaultValue = kLodUses[2];                     // meaning of --lod without a value

/// Adds an option whose value becomes the precision of a configuration.
template <class Value>
CLI::Option* add_precision(CLI::App& verb, BakeConfig& config, PrecisionKind kind, const char* name, const char* type,
                           const char* description) {
  const auto set = [&config, kind](Value value) {
    config.precision_kind = kind;
    config.precision = static_cast<double>(value);
  };
  return verb.add_option_function<Value>(name, set, description)
      ->type_name(type)
      ->group("Precision of positions (at most one of these)");
}

/// Adds the options that set the precision of a configuration; at most one may be given.
void add_precision_options(CLI::App& verb, BakeConfig& config) {
  const std::array<CLI::Option*, 4> precisions{
      add_precision<double>(
          verb, config, PrecisionKind::kEdgeFraction, "--grid-step-edge,--precision-edge", "F",
          "Grid step as a fraction of the median edge length, 1e-9..1 (default 1/128, and finer where thin triangles, "
          "contacts or close views need it). Smaller steps give larger files"),
      add_precision<double>(verb, config, PrecisionKind::kDiagonalFraction, "--grid-step,--precision", "REL",
                            "Grid step as a fraction of the bounding box diagonal, 1e-12..0.1"),
      add_precision<double>(verb, config, PrecisionKind::kAbsolute, "--grid-step-abs,--precision-abs", "UNITS",
                            "Grid step in world units; positions move by at most half of it per axis"),
      add_precision<uint32_t>(verb, config, PrecisionKind::kPositionBits, "--position-bits", "N",
                              "Bits per coordinate along the longest side of the bounding box, 1..40")};
  for (CLI::Option* option : precisions)
    for (CLI::Option* other : precisions)
      if (option != other) option->excludes(other);
}

/// Options for what is stored, and for normals and texture coordinates.
void add_stream_options(CLI::App& verb, BakeOptions& options) {
  std::vector<std::string> encodings{kAuto};
  for (const NormalFormat& format : kNormalFormats) encodings.emplace_back(format.name);
  verb.add_option(
          "--normals", options.normals,
          "Normal encoding. auto picks for each geometry the smallest of axis12, axis16, oct20, axis24 and axis32 that "
          "meets --normal-error (default auto)")
      ->check(one_of(encodings))
      ->default_str(kAuto)
      ->group("Normals");
  verb.add_option("--normal-error", options.normal_error,
                  "Maximum angle between source and decoded normals with --normals auto, 0.0025..10 degrees (default "
                  "0.04, and more in geometries whose grid is coarser than the default grid)")
      ->type_name("DEGREES")
      ->group("Normals");
  verb.add_option("--for", options.purpose,
                  "Purpose of the file; data it does not need is dropped. ao suffices for ambient occlusion; shading "
                  "also keeps material textures, and the texture coordinates used by textures and normal maps (default "
                  "ao)")
      ->check(one_of(std::vector<std::string>(kPurposes.begin(), kPurposes.end())))
      ->default_str(options.purpose)
      ->group("What is kept");
  verb.add_option("--keep", options.keep, "Streams to store even where --for does not need them, separated by commas")
      ->delimiter(',')
      ->check(one_of({kKeepUvs, kKeepNormals}))
      ->type_name("STREAMS")
      ->group("What is kept");
  verb.add_option(
          "--uvs", options.uvs,
          "Encoding of texture coordinates. auto is accurate to 1/32 texel; unorm16 (steps of 1/65535) and fp16 exist "
          "for compatibility (default auto)")
      ->check(one_of(std::vector<std::string>{kAuto,
                                              std::string(kUvEncodingNames[static_cast<size_t>(UvEncoding::kUnorm16)]),
                                              std::string(kUvEncodingNames[static_cast<size_t>(UvEncoding::kFp16)])}))
      ->default_str(kAuto)
      ->group("Texture coordinates");
}

void add_texture_options(CLI::App& verb, BakeOptions& options) {
  std::vector<std::string> texture_codecs{kNoTextures, kAuto};
  texture_codecs.insert(texture_codecs.end(), kTextureCodecNames.begin(), kTextureCodecNames.end());
  verb.add_option("--textures", options.textures,
                  "Encoding of material textures. none stores their average colour only; auto picks for each the "
                  "smallest encoding that meets --texture-psnr (default: auto with --for shading, else none)")
      ->check(one_of(texture_codecs))
      ->group("Textures");
  verb.add_option("--texture-psnr", options.texture_psnr,
                  "Minimum PSNR with --textures auto, 10..100 dB of sRGB values (default 34)")
      ->type_name("DB")
      ->group("Textures");
}

void add_level_options(CLI::App& verb, BakeOptions& options) {
  verb.add_option(
          "--lod", options.lod,
          "Store LOD levels, which render --lod-error needs. all adds them to every geometry; instanced only to "
          "geometries with several instances; --lod without a value means all (default off). Each level has less than "
          "half the triangles of the next finer one")
      ->check(one_of(std::vector<std::string>(kLodUses.begin(), kLodUses.end())))
      ->expected(0, 1)
      ->default_str(kLodDefaultValue)
      ->group("Levels of detail");
  verb.add_option("--lod-min-triangles", options.lod_min_triangles,
                  "Minimum number of triangles for a geometry to get LOD levels (default 128)")
      ->type_name("N")
      ->group("Levels of detail");
  verb.add_option("--lod-levels", options.lod_levels,
                  "Maximum number of levels coarser than level 0, 1..31 (default 31)")
      ->type_name("N")
      ->group("Levels of detail");
  verb.add_option(
          "--resume", options.resume,
          "Folder that collects finished LOD levels. If bake is interrupted, run it again with the same folder to "
          "continue; its contents are removed after the file was written")
      ->type_name("DIR")
      ->group("Levels of detail");
}

void add_choice_options(CLI::App& verb, BakeOptions& options) {
  verb.add_option("--preset", options.preset,
                  "Options to start from; others override them. smallest: 16 bits, coarse normals, codec small, no "
                  "trees. balanced: default precision, codec fast. exact: 24 bits, the finest normals")
      ->check(one_of(std::vector<std::string>(kPresets.begin(), kPresets.end())))
      ->group("Choosing by result");
  verb.add_option("--target", options.targets,
                  "Search for the smallest file that keeps a measured limit: ao-error=X (mean absolute error), "
                  "position-error=UNITS, normal-error=DEGREES or size=3MB. Repeat it for several limits. Options that "
                  "are given are not changed; exit code 5 if no file keeps the limits")
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false)
      ->take_all()
      ->group("Choosing by result");
  verb.add_option("--camera", options.camera,
                  "Camera of the pictures that --target compares: a number in the scene, from 0, or auto for a view of "
                  "the whole scene (default 0, or auto if there is no camera or camera 0 sees nothing)")
      ->type_name("I|auto")
      ->group("Choosing by result");
}

void add_motion_options(CLI::App& verb, BakeOptions& options) {
  verb.add_option("--motion", options.motion,
                  "Store the rigid motion of shapes, instances and cameras (keep), or leave everything as it stands at "
                  "--time (off) (default keep)")
      ->check(one_of({"keep", "off"}))
      ->default_str("keep")
      ->group("Motion");
  verb.add_option("--keys", options.keys,
                  "JSON file of keys that move instances; stored in the file. They replace the scene's motion of these "
                  "instances")
      ->type_name("FILE")
      ->group("Motion");
}

void add_distance_level_option(CLI::App& verb, BakeOptions& options) {
  verb.add_option("--distance-levels", options.distance_levels,
                  "JSON file that chains objects which stand for each other at different distances from the eye; "
                  "frames choose one for each instance. Stored in the file")
      ->type_name("FILE")
      ->group("Levels of detail");
}

void add_sequence_options(CLI::App& verb, BakeOptions& options) {
  constexpr const char* kGroup = "Meshes that move";
  verb.add_option(
          "--sequence", options.sequences,
          "PLY files of one topology that move a mesh of the scene, such as 'grass_%04d.ply' with one %d or "
          "%0Nd for the frame's number; relative to the working directory or the scene. The first frame is "
          "the file that the scene refers to, the last the one before the first missing number. Repeat it for "
          "several meshes. 'animation' stands for what the animation of a glTF file deforms by morph targets and "
          "skins. Their geometries get no LOD levels")
      ->type_name("PATTERN|animation")
      ->allow_extra_args(false)
      ->take_all()
      ->group(kGroup);
  verb.add_option("--sequence-fps", options.sequence_fps, "Frames per second of all sequences (default 24)")
      ->type_name("F")
      ->group(kGroup);
  verb.add_option("--sequence-start", options.sequence_start,
                  "Number of the first frame of all sequences (default: the smallest in the scene)")
      ->type_name("N")
      ->group(kGroup);
  verb.add_option("--sequence-group", options.sequence_group,
                  "Frames per group, 1..64 (default 8). A frame is decoded from the begin of its group on; larger "
                  "groups take fewer bytes, but longer to reach")
      ->type_name("N")
      ->group(kGroup);
}

} // namespace

void add_bake_options(CLI::App& verb, BakeOptions& options) {
  verb.add_option("SCENE", options.inputs,
                  "pbrt-v3 scene, or one or more .gltf, .glb, .obj, .ply or .stl files, which make one scene")
      ->required();
  add_output_option(verb, options.output,
                    "Output file (.ptk), or - for standard output. Required unless --dry-run is given");
  add_precision_options(verb, options.config);
  add_stream_options(verb, options);
  add_texture_options(verb, options);
  add_level_options(verb, options);
  verb.add_option("--trees", options.trees,
                  "Store BVH trees for the packed tracer, 1 to 2.5 bytes per triangle (default on). Without them files "
                  "are smaller, but every render builds the trees first")
      ->check(one_of({"on", "off"}))
      ->default_str("on");
  verb.add_option(
          "--codec", options.codec,
          "Compression on disk. none is memory-mapped and traced as it is; fast and small are decoded into memory when "
          "the file is opened. small gives the smallest file; fast opens more than ten times as fast as small (default "
          "none)")
      ->check(one_of({std::string(name_of(PageCodec::kNone)), std::string(name_of(PageCodec::kFast)),
                      std::string(name_of(PageCodec::kSmall))}))
      ->default_str(std::string(name_of(PageCodec::kNone)));
  add_motion_options(verb, options);
  add_distance_level_option(verb, options);
  add_sequence_options(verb, options);
  add_proxy_options(verb, options.proxy);
  add_choice_options(verb, options);
  verb.add_flag("--dry-run", options.dry_run, "Import and bake without writing a file, to see sizes and errors");
  add_scene_options(verb, options.scene);
  verb.footer("Positions are rounded to an integer grid. Shapes outside objects share one grid, so\n"
              "meshes that touch stay closed; a mesh used by several shapes is stored once, on its\n"
              "own grid. The position error measured against the source is printed and stored in\n"
              "the file; per axis it is at most half a grid step plus the rounding to floats.\n"
              "Without a precision option the grid is fine enough for pictures from the scene's\n"
              "cameras; a warning at the end says where it is not. Dropped data is listed with the\n"
              "reason; -v lists it per geometry.\n"
              "Examples:\n"
              "  packtrace bake house.pbrt -o house.ptk\n"
              "  packtrace bake scan.ply stand.obj -o both.ptk --up z\n"
              "  packtrace bake forest.pbrt -o forest.ptk --lod --codec small\n"
              "  packtrace bake meadow.pbrt -o meadow.ptk --sequence 'grass_%04d.ply' --sequence-fps 30\n"
              "  packtrace bake house.pbrt -o - | ssh host 'cat > house.ptk'\n"
              "  packtrace bake house.pbrt -o small.ptk --grid-step 1e-4 --json report.json\n"
              "  packtrace bake house.pbrt -o small.ptk --target ao-error=0.002");
}

bool chooses_grid(const BakeOptions& options) { return options.config.precision_kind != PrecisionKind::kPicture; }

void apply_preset(BakeOptions& options) {
  if (options.preset.empty()) return;
  const bool smallest = options.preset == kPresets[0], balanced = options.preset == kPresets[1];
  if (!chooses_grid(options) && !balanced) {
    options.config.precision_kind = PrecisionKind::kPositionBits;
    options.config.precision = smallest ? 16 : 24; // floats have 24 bits
  }
  if (!options.normals && !options.normal_error && !balanced) options.normals = smallest ? "axis16" : "axis32";
  if (!options.codec)
    options.codec = std::string(name_of(smallest ? PageCodec::kSmall : balanced ? PageCodec::kFast : PageCodec::kNone));
  if (!options.trees && smallest) options.trees = "off";
}

BakeConfig make_config(const BakeOptions& options) {
  BakeConfig config = options.config;
  config.proxy = make_proxy_config(options.proxy);
  config.normals = find_normal_encoding(options.normals.value_or(kAuto));
  if (config.normals && options.normal_error)
    throw Error(ErrorKind::kUsage,
                "--normal-error only applies to --normals auto, not to --normals " + *options.normals);
  config.normal_error_degrees = options.normal_error;
  config.purpose = options.purpose == kPurposes[baked::kShading] ? baked::kShading : baked::kAo;
  for (const std::string& stream : options.keep) (stream == kKeepUvs ? config.keep_uvs : config.keep_normals) = true;
  config.strict = options.scene.strict;
  config.uvs = find_uv_encoding(options.uvs);
  const std::string textures = options.textures.value_or(config.purpose == baked::kShading ? kAuto : kNoTextures);
  config.textures = textures != kNoTextures;
  config.texture_codec = find_texture_codec(textures);
  if (config.textures && config.purpose != baked::kShading)
    throw Error(ErrorKind::kUsage, "--textures " + textures + " requires --for shading");
  if (options.texture_psnr && textures != kAuto)
    throw Error(ErrorKind::kUsage, "--texture-psnr only applies to --textures auto");
  if (options.texture_psnr) config.min_texture_psnr_db = *options.texture_psnr;
  config.lod = static_cast<LodUse>(std::find(kLodUses.begin(), kLodUses.end(), options.lod) - kLodUses.begin());
  if (config.lod == LodUse::kOff && (options.lod_min_triangles || options.lod_levels || !options.resume.empty()))
    throw Error(ErrorKind::kUsage, "--lod-min-triangles, --lod-levels and --resume require --lod");
  config.lod_min_triangles = options.lod_min_triangles.value_or(config.lod_min_triangles);
  config.lod_levels = options.lod_levels.value_or(config.lod_levels);
  if (options.camera && options.targets.empty())
    throw Error(ErrorKind::kUsage, "--camera only applies to --target; a file is for all cameras");
  if (options.sequences.empty() && (options.sequence_fps || options.sequence_start || options.sequence_group))
    throw Error(ErrorKind::kUsage, "--sequence-fps, --sequence-start and --sequence-group require --sequence");
  if (!options.sequences.empty() && !options.targets.empty())
    throw Error(ErrorKind::kUsage, "--target measures still scenes: it cannot be combined with --sequence");
  if (std::ranges::find(options.sequences, kAnimationSequence) != options.sequences.end())
    for (const std::string& input : options.inputs)
      if (scene_format(input) == SceneFormat::kPbrt)
        throw Error(ErrorKind::kUsage, "--sequence animation only applies to glTF files");
  if (options.sequence_fps && !(*options.sequence_fps > 0.0 && std::isfinite(*options.sequence_fps)))
    throw Error(ErrorKind::kUsage, "--sequence-fps must be a positive number");
  config.sequence_group = options.sequence_group.value_or(config.sequence_group);
  config.resume = options.resume;
  config.trees = options.trees.value_or("on") == "on";
  config.choose_codec(find_page_codec(options.codec.value_or(std::string(name_of(PageCodec::kNone))))
                          .value()); // the option's check accepts only these names
  config.validate();
  return config;
}

} // namespace packtrace
