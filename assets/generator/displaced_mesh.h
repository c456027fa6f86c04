#pragma once

#include <cstdint>

#include "assets/generator/scene_writer.h"

namespace packtrace::scenegen {

struct DisplacedMeshConfig {
  uint64_t seed = 3;
  uint64_t triangles = 6'000'000; ///< minimum number of unique triangles; [100, 2000000000]
};

/// Writes one closed mesh, a ring of eroded rock with vertex normals, above a plain: FOLDER/mesh.pbrt. Rows of the ring
/// are computed in parallel and streamed to disk, so memory does not grow with the number of triangles.
/// Throws Error(kUsage) if config is out of range, Error(kIo) if writing fails.
SceneTotals generate_displaced_mesh(const DisplacedMeshConfig& config, const OutputConfig& output);

} // namespace packtrace::scenegen
