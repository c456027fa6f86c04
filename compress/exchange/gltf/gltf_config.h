#pragma once

#include <cstdint>
#include <string>

#include "compress/exchange/gltf/draco_primitive.h"

namespace packtrace {

/// How the triangles of a glTF file are stored.
enum class GltfCodec : uint8_t {
  kNone,   ///< floats
  kDraco,  ///< KHR_draco_mesh_compression
  kMeshopt ///< EXT_meshopt_compression of integers (KHR_mesh_quantization)
};

/// Purpose of a file.
enum class GltfProfile : uint8_t {
  kPortable, ///< no extension at all
  kWeb,      ///< the smallest file that decodes fast in a browser
  kExchange  ///< the smallest file, for other programs, with all names
};

struct GltfConfig {
  GltfCodec codec = GltfCodec::kDraco;
  DracoConfig draco;
  int meshopt_normal_bits = 8; ///< 4..16 per axis, octahedral; only with kMeshopt
  /// Store instances of a mesh as one node with EXT_mesh_gpu_instancing (required to read the file) where their maps
  /// are translation, rotation and scale. With kMeshopt their values are rounded to a fraction of the lattice's step.
  bool instancing = false;
  /// Write WebP images (EXT_texture_webp), lossless or of at least this PSNR in dB, instead of PNG. 0: PNG.
  double webp_psnr = 0.0;
  /// Use extensions for materials and textures: KHR_texture_transform, KHR_materials_transmission. Without them
  /// texture coordinates are transformed, and transmitting materials are blended.
  bool material_extensions = true;
  /// Keep the names of meshes and materials and the materials' flags. Without them equal materials are merged, and so
  /// are meshes in world space with the same material.
  bool names = true;
  /// Write the levels of detail of meshes with MSFT_lod. Their instances are separate nodes.
  bool levels = false;
  /// File name of a separate buffer; the document is then JSON text. Empty: one binary file.
  std::string buffer_name;
};

/// The settings of a profile.
GltfConfig gltf_profile(GltfProfile profile);

/// Throws Error(kUsage) for settings out of range. Those of codecs that are not chosen are not checked.
void validate(const GltfConfig& config);

} // namespace packtrace
