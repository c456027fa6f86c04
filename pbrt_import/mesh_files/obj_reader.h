#pragma once

#include <filesystem>

#include "pbrt_import/mesh_files/mesh_file_context.h"

namespace packtrace {

/// Reads a Wavefront OBJ file and its MTL files: one shape per object, material, and presence of normals and texture
/// coordinates. Faces with more than three corners are triangulated (polygon.h). Points, lines and free-form geometry
/// are left out and reported once. A face with a missing vertex is left out and reported.
/// @param file_number of the file in SourceFiles
/// Throws Error(kInput) like read_whole_file(); MemoryError; Error(kCancelled).
/// Source: Wavefront, Object Files (.obj), appendix B1 of the Advanced Visualizer manual.
void read_obj(const std::filesystem::path& file, uint32_t file_number, const MeshFileContext& context);

} // namespace packtrace
