#include "compress/exchange/gltf/gltf_config.h"

#include "pbrt_import/base/error.h"

namespace packtrace {

GltfConfig gltf_profile(GltfProfile profile) {
  constexpr double kWebPsnr = 40.0; // dB, of textures
  GltfConfig config;
  switch (profile) {
  case GltfProfile::kPortable:
    config.codec = GltfCodec::kNone;
    config.material_extensions = false;
    break;
  case GltfProfile::kWeb:
    config.codec = GltfCodec::kMeshopt;
    config.instancing = true;
    config.webp_psnr = kWebPsnr;
    config.names = false;
    break;
  case GltfProfile::kExchange:
    break;
  }
  return config;
}

void validate(const GltfConfig& config) {
  const auto require = [](bool condition, const char* message) {
    if (!condition) throw Error(ErrorKind::kUsage, message);
  };
  if (config.codec == GltfCodec::kDraco) {
    require(config.draco.level >= 0 && config.draco.level <= 10, "Draco's level must be 0 to 10");
    require(config.draco.normal_bits >= 2 && config.draco.normal_bits <= 30, "normals take 2 to 30 bits");
    require(config.draco.uv_bits >= 1 && config.draco.uv_bits <= 30, "texture coordinates take 1 to 30 bits");
  }
  if (config.codec == GltfCodec::kMeshopt)
    require(config.meshopt_normal_bits >= 4 && config.meshopt_normal_bits <= 16,
            "normals of the codec meshopt take 4 to 16 bits");
  require(config.webp_psnr >= 0.0 && config.webp_psnr <= 100.0, "the PSNR of textures must be 0 to 100 dB");
}

} // namespace packtrace
