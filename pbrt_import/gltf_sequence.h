#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "pbrt_import/base/progress.h"
#include "pbrt_import/import_scene.h"
#include "pbrt_import/scene/mesh_sequence.h"

namespace packtrace {

/// Frames of the meshes that the animations of glTF files deform by morph targets or skins, evaluated at k / fps
/// seconds for frame k. There are as many frames as the animation's duration has, rounded, and at least two; so frames
/// repeat with the animation, as the tracks of nodes do.
/// @param imported the scene of the files, which was read with pose_time 0
/// @param options of that import. The frames take 12 bytes per vertex of its memory while the result lives
/// Throws Error(kInput) if nothing deforms, or if a frame has other meshes than the scene; MemoryError;
/// Error(kCancelled).
std::vector<MeshSequence> find_gltf_sequences(const ImportResult& imported,
                                              std::span<const std::filesystem::path> files,
                                              const ImportOptions& options, double frames_per_second,
                                              Progress& progress);

} // namespace packtrace
