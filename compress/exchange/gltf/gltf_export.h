#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "compress/exchange/gltf/draco_primitive.h"
#include "compress/format/file/baked_file.h"
#include "pbrt_import/base/progress.h"

namespace packtrace {

struct GltfConfig {
  bool draco = true; ///< KHR_draco_mesh_compression, required by the file; false: plain floats and 32-bit indices
  DracoConfig codec;
};

/// What an export did.
struct GltfReport {
  uint64_t meshes = 0, primitives = 0, nodes = 0, materials = 0, images = 0, cameras = 0;
  uint64_t vertices = 0, triangles = 0;
  uint64_t geometry_bytes = 0, image_bytes = 0, file_bytes = 0;
  uint64_t collapsed_triangles = 0; ///< corners coincide: left out by Draco
  uint64_t plain_primitives = 0; ///< of geometry that needs more than 30 bits, or that Draco refuses: stored as floats
  uint64_t simplified_materials = 0; ///< mask and texture lie differently on the surface: the texture is left out
  uint64_t skipped_cameras = 0;      ///< environment cameras: glTF has none
};

struct GltfExport {
  std::vector<std::byte> bytes; ///< binary glTF 2.0 (.glb)
  GltfReport report;
};

/// A baked file as one binary glTF: meshes, instances as nodes, materials with masks and textures, cameras. A root node
/// mirrors x, as glTF is right-handed. Geometry that instances give different materials is stored once.
/// Positions on one lattice stay on it (world-space geometry shares one): what touches in the file touches in the
/// export. The bytes depend on the arguments only. Throws Error(kUsage) for a config out of range,
/// Error(kLimitExceeded) beyond the 4 GiB of a .glb, Error(kCancelled).
GltfExport export_gltf(const BakedFile& file, const GltfConfig& config, Progress& progress);

} // namespace packtrace
