#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "pbrt_import/scene/mesh_sequence.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// Finds the mesh of a scene that a sequence of PLY files moves. Frame 0 is the file that the scene refers to; the
/// frames after it have the numbers that follow, up to the first missing one. Files are read on demand.
/// @param files all files that the scene names (ImportResult::files)
/// @param main_file of the scene: a relative pattern is looked up in the working directory, then in the scene's folder
/// @param pattern as FramePattern
/// @param start number of frame 0; unset: the smallest number among the files that the scene names
/// Throws Error(kUsage) for a bad pattern or start; Error(kInput) if the scene uses no mesh of frame 0's file, with the
/// name of the nearest one, if a frame is missing before others, if there is one frame only, or if frame 0 cannot be
/// read.
MeshSequence find_mesh_sequence(const Scene& scene, std::span<const std::filesystem::path> files,
                                const std::filesystem::path& main_file, const std::string& pattern,
                                std::optional<int64_t> start, double frames_per_second);

} // namespace packtrace
