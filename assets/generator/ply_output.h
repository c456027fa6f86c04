#pragma once

#include <cstdint>

#include "assets/generator/buffered_file.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace::scenegen {

/// What a PLY header announces.
struct PlyLayout {
  uint64_t vertex_count = 0;
  uint64_t face_count = 0;
  bool normals = false;
  bool uvs = false;
  bool short_indices = false; ///< `list uchar ushort`, else `list uchar int`
};

/// Begins a binary little-endian PLY of float x y z [nx ny nz] [u v] vertices and faces. The caller then writes each
/// vertex's floats and each triangle.
void write_ply_header(BufferedFile& file, const PlyLayout& layout);
void write_ply_triangle(BufferedFile& file, const Triangle& triangle); ///< of 32-bit indices

/// A whole mesh, small: 16-bit indices where they suffice, and neighbouring triangles (a,b,c) (a,c,d) as one quad.
void write_ply(BufferedFile& file, const Mesh& mesh);

} // namespace packtrace::scenegen
