#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pbrt_import/base/progress.h"
#include "pbrt_import/scene/bounds.h"
#include "pbrt_import/scene/mesh_sequence.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// What all frames of a moving mesh have in common.
struct SequenceMeasure {
  Bounds bounds; ///< of all frames, mesh space
  /// By vertex: the first vertex that has the same position in every frame. Vertices that only meet in some frames stay
  /// apart.
  std::vector<uint32_t> same_path;
};

/// Reads all frames, one at a time.
/// Throws what MeshFrames::positions() throws; Error(kInput) if the sequence has fewer than two frames, if a frame has
/// another number of vertices than the mesh or a position that is not finite, or if frame 0 is not the scene's mesh.
SequenceMeasure measure_sequence(const Scene& scene, const MeshSequence& sequence, Progress& progress);

} // namespace packtrace
