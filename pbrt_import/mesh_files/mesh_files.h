#pragma once

#include <filesystem>
#include <span>

#include "pbrt_import/mesh_files/mesh_file_context.h"
#include "pbrt_import/scene_format.h"

namespace packtrace {

/// Reads PLY, OBJ and STL files as the world of one scene, in their order. Their coordinates are scaled and turned as
/// ImportOptions::mesh_scale and mesh_up say.
/// @return position of the end of the last file
/// Throws FileError(kInput) if a file cannot be read; MemoryError; Error(kCancelled).
Place read_mesh_files(std::span<const std::filesystem::path> files, const MeshFileContext& context);

} // namespace packtrace
