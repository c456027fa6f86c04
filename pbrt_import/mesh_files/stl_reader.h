#pragma once

#include <filesystem>

#include "pbrt_import/mesh_files/mesh_file_context.h"

namespace packtrace {

/// Reads an STL file, binary or text: one shape with flat normals, whose equal corners become one vertex. The file's
/// own normals are ignored, since they follow from the order of the corners.
/// @param file_number of the file in SourceFiles
/// Throws Error(kInput) if the file cannot be read or is damaged; MemoryError; Error(kCancelled).
/// Source: 3D Systems, StereoLithography Interface Specification, 1988.
void read_stl(const std::filesystem::path& file, uint32_t file_number, const MeshFileContext& context);

} // namespace packtrace
