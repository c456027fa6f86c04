#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "pbrt_import/scene/scene.h"
#include "pbrt_import/shapes/report.h"

namespace packtrace {

/// What one PLY file holds.
struct PlyMesh {
  Mesh mesh;                      ///< unnamed; keeps the contract of Mesh
  uint64_t dropped_triangles = 0; ///< bad indices or vertices; each kind is one report
};

/// Reads a PLY 1.0 file (ASCII, little- or big-endian binary) the way pbrt-v3's plymesh shape does: vertices x y z,
/// optional nx ny nz, optional u v | s t | texture_u texture_v | texture_s texture_t, and polygons vertex_indices or
/// vertex_index, which become fans (0,1,2), (0,2,3), ... . Unlike pbrt-v3 it reads triangle strips too, the lists of an
/// element "tristrips" with -1 between two strips. Everything else is skipped. No reference to bytes is kept.
/// @param bytes the whole file; memory used is bounded by a small multiple of its size
/// @param memory grows by what this takes, before it is taken; null: nobody counts
/// Throws MemoryError, Error(kInput), message without a file name, if the file is malformed, truncated or without vertices or faces.
/// Source: Greg Turk, The PLY Polygon File Format, 1994.
PlyMesh read_ply(std::span<const std::byte> bytes, const ReportFn& report, MemoryReservation* memory = nullptr);

} // namespace packtrace
