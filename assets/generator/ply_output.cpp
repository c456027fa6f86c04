#include "assets/generator/ply_output.h"

#include <bit>
#include <cstring>
#include <initializer_list>
#include <span>

#include <fmt/format.h>

namespace packtrace::scenegen {

static_assert(std::endian::native == std::endian::little, "PLY bytes are written as they lie in memory");

namespace {

/// Writes 3 or 4 vertex numbers as one face.
template <typename Index>
void write_face(BufferedFile& file, std::initializer_list<uint32_t> vertices) {
  char record[1 + 4 * sizeof(Index)];
  size_t size = 0;
  record[size++] = static_cast<char>(vertices.size());
  for (const uint32_t vertex : vertices) {
    const auto index = static_cast<Index>(vertex);
    std::memcpy(record + size, &index, sizeof index);
    size += sizeof index;
  }
  file.write({record, size});
}

bool makes_quad(std::span<const Triangle> triangles, size_t i) {
  return i + 1 < triangles.size() && triangles[i].x == triangles[i + 1].x && triangles[i].z == triangles[i + 1].y;
}

template <typename Index>
void write_faces(BufferedFile& file, std::span<const Triangle> triangles) {
  for (size_t i = 0; i < triangles.size(); ++i) {
    const Triangle& t = triangles[i];
    if (makes_quad(triangles, i))
      write_face<Index>(file, {t.x, t.y, t.z, triangles[++i].z});
    else
      write_face<Index>(file, {t.x, t.y, t.z});
  }
}

} // namespace

void write_ply_header(BufferedFile& file, const PlyLayout& layout) {
  file.write("ply\nformat binary_little_endian 1.0\ncomment packtrace_scenegen\n");
  file.write(
      fmt::format("element vertex {}\nproperty float x\nproperty float y\nproperty float z\n", layout.vertex_count));
  if (layout.normals) file.write("property float nx\nproperty float ny\nproperty float nz\n");
  if (layout.uvs) file.write("property float u\nproperty float v\n");
  file.write(fmt::format("element face {}\nproperty list uchar {} vertex_indices\nend_header\n", layout.face_count,
                         layout.short_indices ? "ushort" : "int"));
}

void write_ply_triangle(BufferedFile& file, const Triangle& t) { write_face<uint32_t>(file, {t.x, t.y, t.z}); }

void write_ply(BufferedFile& file, const Mesh& mesh) {
  PlyLayout layout{mesh.positions.size(), 0, !mesh.normals.empty(), !mesh.uvs.empty(), mesh.positions.size() <= 65536};
  for (size_t i = 0; i < mesh.triangles.size(); ++i, ++layout.face_count) i += makes_quad(mesh.triangles, i) ? 1 : 0;
  write_ply_header(file, layout);
  for (size_t i = 0; i < mesh.positions.size(); ++i) {
    file.write_value(mesh.positions[i]);
    if (layout.normals) file.write_value(mesh.normals[i]);
    if (layout.uvs) file.write_value(mesh.uvs[i]);
  }
  if (layout.short_indices)
    write_faces<uint16_t>(file, mesh.triangles);
  else
    write_faces<uint32_t>(file, mesh.triangles);
}

} // namespace packtrace::scenegen
