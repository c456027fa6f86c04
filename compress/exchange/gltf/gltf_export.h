#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "compress/exchange/gltf/draco_primitive.h"
#include "compress/format/file/baked_file.h"
#include "pbrt_import/base/progress.h"

namespace packtrace {

struct GltfConfig {
  /// Compress with KHR_draco_mesh_compression (required to read the file); false: floats and 32-bit indices.
  bool draco = true;
  DracoConfig codec;
  /// Store instances of a mesh as one node with EXT_mesh_gpu_instancing (required to read the file) where their maps
  /// are translation, rotation and scale.
  bool instancing = false;
};

/// Statistics of an export.
struct GltfReport {
  uint64_t meshes = 0, primitives = 0, nodes = 0, materials = 0, images = 0, cameras = 0;
  uint64_t grouped_instances = 0; ///< in nodes with EXT_mesh_gpu_instancing
  uint64_t vertices = 0, triangles = 0;
  uint64_t geometry_bytes = 0, image_bytes = 0, file_bytes = 0;
  uint64_t collapsed_triangles = 0; ///< triangles with coinciding corners, dropped by Draco
  uint64_t plain_primitives = 0;    ///< stored as floats: the grid needs more than 30 bits, or Draco fails
  /// Exported without their texture, because mask and texture have different transforms.
  uint64_t simplified_materials = 0;
  uint64_t skipped_cameras = 0; ///< environment cameras, which glTF lacks, and cameras without pixels
};

struct GltfExport {
  std::vector<std::byte> bytes; ///< binary glTF 2.0 (.glb)
  GltfReport report;
};

/// Exports a baked file as one binary glTF: meshes, instances as nodes, materials with masks and textures, and cameras.
/// A root node mirrors x, because glTF is right-handed. Geometry that is instanced with different materials is stored
/// once. Positions stay on their lattice, which world-space geometries share, so surfaces that touch in the file touch
/// in the export. The bytes depend only on the arguments.
/// Throws Error(kUsage) for settings out of range, Error(kLimitExceeded) beyond the 4 GiB of a .glb, Error(kCancelled).
GltfExport export_gltf(const BakedFile& file, const GltfConfig& config, Progress& progress);

} // namespace packtrace
