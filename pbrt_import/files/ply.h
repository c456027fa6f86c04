#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "pbrt_import/scene/scene.h"
#include "pbrt_import/shapes/report.h"

namespace packtrace {

/// Content of a PLY file.
struct PlyMesh {
  Mesh mesh;                      ///< without a name; fulfils the contract of Mesh
  uint64_t dropped_triangles = 0; ///< triangles with bad indices or vertices; one report per kind
};

/// Reads a PLY 1.0 file (ASCII, little- or big-endian binary) like pbrt-v3's plymesh shape: vertices x y z, optional nx
/// ny nz, optional u v | s t | texture_u texture_v | texture_s texture_t, and polygons vertex_indices or vertex_index,
/// which become triangle fans (0,1,2), (0,2,3), ... . Unlike pbrt-v3 it also reads triangle strips: lists of an element
/// "tristrips" with -1 between two strips. All other elements and properties are skipped.
/// @param bytes the whole file, not referenced after return; memory use is bounded by a small multiple of its size
/// @param memory grows by the memory that reading needs, before it is allocated; null: not counted
/// Throws MemoryError; Error(kInput), with a message without file name, if the file is malformed, truncated or without
/// vertices or faces.
/// Source: Greg Turk, The PLY Polygon File Format, 1994.
PlyMesh read_ply(std::span<const std::byte> bytes, const ReportFn& report, MemoryReservation* memory = nullptr);

} // namespace packtrace
