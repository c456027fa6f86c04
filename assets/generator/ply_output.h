#pragma once

#include <cstdint>

#include "assets/generator/buffered_file.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace::scenegen {

/// Contents of a PLY header.
struct PlyLayout {
  uint64_t vertex_count = 0;
  uint64_t face_count = 0;
  bool normals = false;
  bool uvs = false;
  bool short_indices = false; ///< `list uchar ushort`, else `list uchar int`
};

/// Writes the header of a binary little-endian PLY file with float x y z [nx ny nz] [u v] vertices, and faces. The
/// caller then writes the floats of each vertex and each triangle.
void write_ply_header(BufferedFile& file, const PlyLayout& layout);
void write_ply_triangle(BufferedFile& file, const Triangle& triangle); ///< with 32-bit indices

/// Writes a whole mesh compactly: 16-bit indices if they suffice, and consecutive triangles (a,b,c) (a,c,d) as one
/// quad.
void write_ply(BufferedFile& file, const Mesh& mesh);

} // namespace packtrace::scenegen
