#pragma once

#include <cstdint>

#include "assets/generator/scene_writer.h"

namespace packtrace::scenegen {

struct DisplacedMeshConfig {
  uint64_t seed = 3;
  uint64_t triangles = 6'000'000; ///< unique, at least; [100, 2000000000]
};

/// One closed mesh, a ring of eroded rock with vertex normals, over a plain: FOLDER/mesh.pbrt. Rows of the ring are
/// computed in parallel and stream to disk, so memory does not grow with it.
/// Throws Error(kUsage) out of range, Error(kIo) on disk trouble.
SceneTotals generate_displaced_mesh(const DisplacedMeshConfig& config, const OutputConfig& output);

} // namespace packtrace::scenegen
