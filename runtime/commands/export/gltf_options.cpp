#include "runtime/commands/export/gltf_options.h"

#include "runtime/commands/cli/option_checks.h"

namespace packtrace {
namespace {

constexpr const char *kDraco = "draco", *kMeshopt = "meshopt", *kNone = "none";
constexpr const char *kPortable = "portable", *kWeb = "web", *kExchange = "exchange";

} // namespace

std::string name_of(GltfCodec codec) {
  return codec == GltfCodec::kDraco ? kDraco : codec == GltfCodec::kMeshopt ? kMeshopt : kNone;
}

std::vector<std::string> GltfOptions::names() const {
  std::vector<std::string> names;
  if (profile) names.push_back("--profile");
  if (codec) names.push_back("--codec");
  if (level) names.push_back("--level");
  if (normal_bits) names.push_back("--normal-bits");
  if (uv_bits) names.push_back("--uv-bits");
  if (webp_psnr) names.push_back("--webp-psnr");
  if (instancing) names.push_back("--instancing");
  if (levels) names.push_back("--levels");
  return names;
}

std::string GltfOptions::profile_name() const { return profile.value_or(kExchange); }

GltfConfig GltfOptions::config() const {
  const std::string name = profile_name();
  GltfConfig config = gltf_profile(name == kPortable ? GltfProfile::kPortable
                                   : name == kWeb    ? GltfProfile::kWeb
                                                     : GltfProfile::kExchange);
  if (codec)
    config.codec = *codec == kDraco ? GltfCodec::kDraco : *codec == kMeshopt ? GltfCodec::kMeshopt : GltfCodec::kNone;
  const std::string chosen =
      "the codec " + name_of(config.codec) + (codec ? "" : " of --profile " + name) + ", only on ";
  std::vector<std::string> of_draco;
  if (level) of_draco.push_back("--level");
  if (uv_bits) of_draco.push_back("--uv-bits");
  if (config.codec != GltfCodec::kDraco) refuse_without_effect(of_draco, chosen + kDraco);
  if (config.codec == GltfCodec::kNone && normal_bits)
    refuse_without_effect({"--normal-bits"}, chosen + kDraco + " and " + kMeshopt);
  if (level) config.draco.level = *level;
  if (normal_bits)
    (config.codec == GltfCodec::kMeshopt ? config.meshopt_normal_bits : config.draco.normal_bits) = *normal_bits;
  if (uv_bits) config.draco.uv_bits = *uv_bits;
  if (webp_psnr) config.webp_psnr = *webp_psnr;
  config.instancing |= instancing;
  config.levels |= levels;
  validate(config);
  return config;
}

void add_gltf_options(CLI::App& verb, GltfOptions& options) {
  constexpr const char* kGroup = "glTF (.glb, .gltf)";
  verb.add_option("--profile", options.profile,
                  "What the file is for. portable uses no extension, so every viewer reads it; web is small and "
                  "decodes fast in browsers: integers with EXT_meshopt_compression, instances with "
                  "EXT_mesh_gpu_instancing, WebP images; exchange is for other programs: Draco, all names (default "
                  "exchange). The options below replace single settings of a profile")
      ->check(one_of({kPortable, kWeb, kExchange}))
      ->group(kGroup);
  verb.add_option("--codec", options.codec,
                  "Geometry compression. draco uses KHR_draco_mesh_compression, meshopt EXT_meshopt_compression; none "
                  "stores floats (default: draco for exchange, meshopt for web, none for portable)")
      ->check(one_of({kDraco, kMeshopt, kNone}))
      ->group(kGroup);
  verb.add_option("--level", options.level,
                  "Codec draco: compression level, 0 (fastest) to 10 (smallest file) (default 7)")
      ->check(CLI::Range(0, 10))
      ->group(kGroup);
  verb.add_option("--normal-bits", options.normal_bits,
                  "Codecs draco and meshopt: quantisation bits of octahedral normals; draco 2..30 (default 12), "
                  "meshopt 4..16 (default 8)")
      ->check(CLI::Range(2, 30))
      ->group(kGroup);
  verb.add_option("--uv-bits", options.uv_bits,
                  "Codec draco: quantisation bits of texture coordinates over their range, 1..30 (default 14). Raise "
                  "it if textures shift. meshopt takes as many as an eighth of a texel needs")
      ->check(CLI::Range(1, 30))
      ->group(kGroup);
  verb.add_option("--webp-psnr", options.webp_psnr,
                  "Write images as WebP of at least this PSNR in dB, 0..100; 100 is lossless, 0 writes PNG (default 40 "
                  "for web, else 0)")
      ->check(CLI::Range(0.0, 100.0))
      ->group(kGroup);
  verb.add_flag("--instancing", options.instancing,
                "Store the instances of a mesh in one node with EXT_mesh_gpu_instancing, as web does: much smaller "
                "files of many instances, for viewers that know the extension")
      ->group(kGroup);
  verb.add_flag("--levels", options.levels,
                "Write levels of detail with MSFT_lod, with the screen coverage at which their error is a pixel")
      ->group(kGroup);
}

} // namespace packtrace
