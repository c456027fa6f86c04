#include "runtime/commands/bake_options.h"

#include <algorithm>

#include "pbrt_import/base/error.h"

namespace packtrace {

bool chooses_grid(const BakeOptions& options) {
  return options.precision || options.precision_abs || options.precision_edge || options.position_bits;
}

void apply_preset(BakeOptions& options) {
  if (options.preset.empty()) return;
  const bool smallest = options.preset == kPresets[0], balanced = options.preset == kPresets[1];
  if (!chooses_grid(options) && !balanced) options.position_bits = smallest ? 16 : 24; // floats have 24 bits
  if (!options.normals && !options.normal_error && !balanced) options.normals = smallest ? "axis16" : "axis32";
  if (!options.codec)
    options.codec = std::string(name_of(smallest ? PageCodec::kSmall : balanced ? PageCodec::kFast : PageCodec::kNone));
  if (!options.trees && smallest) options.trees = "off";
}

BakeConfig make_config(const BakeOptions& options) {
  BakeConfig config;
  const auto set_precision = [&](PrecisionKind kind, double value) {
    config.precision_kind = kind;
    config.precision = value;
  };
  if (options.precision) set_precision(PrecisionKind::kDiagonalFraction, *options.precision);
  if (options.precision_abs) set_precision(PrecisionKind::kAbsolute, *options.precision_abs);
  if (options.precision_edge) set_precision(PrecisionKind::kEdgeFraction, *options.precision_edge);
  if (options.position_bits) set_precision(PrecisionKind::kPositionBits, static_cast<double>(*options.position_bits));
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
  config.resume = options.resume;
  config.trees = options.trees.value_or("on") == "on";
  config.codec = find_page_codec(options.codec.value_or(std::string(name_of(PageCodec::kNone))))
                     .value(); // the option's check accepts only these names
  config.validate();
  return config;
}

} // namespace packtrace
