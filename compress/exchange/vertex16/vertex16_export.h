#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "compress/format/file/baked_file.h"
#include "pbrt_import/base/progress.h"

namespace packtrace {

/// What an export did. Errors are those of the export, against what the file decodes to.
struct Vertex16Report {
  uint64_t geometries = 0, draws = 0, instances = 0, materials = 0;
  uint64_t vertices = 0, triangles = 0;
  uint64_t vertex_bytes = 0, index_bytes = 0, file_bytes = 0;
  uint64_t coarser_geometries = 0;       ///< whose lattice had to lose bits
  double max_position_error = 0.0;       ///< larger axis, object units; 0 where coordinates are below 2^24 steps
  double max_normal_error_degrees = 0.0; ///< 0 where the file's encoding is axis24
  double max_uv_error = 0.0;             ///< larger axis
  double max_tangent_error_degrees = 0.0;
};

struct Vertex16Export {
  std::vector<std::byte> bytes; ///< the file, docs/vertex16.md
  Vertex16Report report;
};

/// A baked file as vertex and index buffers of 16 bytes a vertex. The bytes depend on the file only.
/// Throws Error(kLimitExceeded) beyond 2^32 - 1 vertices or indices, or where a step leaves the range of floats;
/// Error(kCancelled).
Vertex16Export export_vertex16(const BakedFile& file, Progress& progress);

} // namespace packtrace
