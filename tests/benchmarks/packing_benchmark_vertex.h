#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "tests/benchmarks/packing_benchmark_codecs.h"

namespace packtrace {

/// A mesh with vertices of one fixed size: position on a lattice relative to the box's corner, octahedral normal, UV.
struct FixedVertices {
  PackingBox box;
  double step = 0.0;
  Vec2 uv_lo{0.0f}, uv_step{0.0f};
  bool wide = false; ///< 32-bit positions
  bool has_normals = false, has_uvs = false;
  size_t vertex_count = 0;
  std::vector<std::byte> bytes; ///< vertex_count x stride()

  /// Bytes per vertex, a multiple of 4.
  size_t stride() const;
};

/// Output arrays of a decoder of FixedVertices.
struct PlainMesh {
  std::vector<Vec3> positions, normals;
  std::vector<Vec2> uvs;
  std::vector<Triangle> triangles;
};

/// Packs positions, normals and UVs of a mesh. Chooses 32-bit positions if the precision requires them.
FixedVertices pack_vertices(const Mesh& mesh, const PackingPrecision& precision);
/// Fills positions, normals and UVs from vertex bytes with the given layout.
void unpack_vertices(const FixedVertices& layout, std::span<const std::byte> bytes, PlainMesh& out);

/// @param source_vertex source vertex of each decoded vertex; empty: same numbers
PackingErrors compare_vertices(const Mesh& source, const PlainMesh& decoded, std::span<const uint32_t> source_vertex);

} // namespace packtrace
