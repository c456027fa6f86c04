#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "compress/exchange/gltf/export_losses.h"
#include "compress/exchange/gltf/gltf_config.h"
#include "compress/format/file/baked_file.h"
#include "pbrt_import/base/progress.h"

namespace packtrace {

/// Statistics of an export.
struct GltfReport {
  uint64_t meshes = 0, primitives = 0, nodes = 0, materials = 0, images = 0, cameras = 0, levels = 0;
  uint64_t grouped_instances = 0; ///< in nodes with EXT_mesh_gpu_instancing
  uint64_t vertices = 0, triangles = 0;
  uint64_t geometry_bytes = 0, image_bytes = 0, file_bytes = 0;
  /// Triangles with coinciding corners, dropped by Draco, or with equal vertices, dropped for meshopt.
  uint64_t collapsed_triangles = 0;
  uint64_t plain_primitives = 0; ///< stored as floats: the lattice has too many bits for the codec, or Draco fails
  /// Exported without their texture, because mask and texture have different transforms.
  uint64_t simplified_materials = 0;
  bool moving = false;            ///< motion is left out: everything is at the time that was baked
  uint64_t skipped_cameras = 0;   ///< environment cameras, which glTF lacks, and cameras without pixels
  std::vector<ExportLoss> losses; ///< of what no other counter has
  // Errors against the baked file.
  double max_normal_error_degrees = 0.0; ///< of the codec meshopt
  double max_uv_error = 0.0;             ///< of the codec meshopt
  double max_placement_error = 0.0;      ///< of instances with rounded values, world units
  double min_texture_psnr = 0.0;         ///< dB; infinite if all textures are exact
};

struct GltfExport {
  std::vector<std::byte> bytes;  ///< binary glTF 2.0 (.glb), or JSON text (.gltf)
  std::vector<std::byte> buffer; ///< the separate buffer, if the config names one
  GltfReport report;
};

/// Exports a baked file as glTF 2.0: meshes, instances as nodes, materials with masks and textures, and cameras.
/// A root node mirrors x, because glTF is right-handed. Geometry that is instanced with different materials is stored
/// once. Positions stay on their lattice, which world-space geometries share, so surfaces that touch in the file touch
/// in the export. The bytes depend only on the arguments.
/// Throws Error(kUsage) for settings out of range, Error(kLimitExceeded) beyond the 4 GiB of a .glb, Error(kCancelled).
GltfExport export_gltf(const BakedFile& file, const GltfConfig& config, Progress& progress);

} // namespace packtrace
