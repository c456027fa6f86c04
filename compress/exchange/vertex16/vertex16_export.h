#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "compress/format/file/baked_file.h"
#include "pbrt_import/base/progress.h"

namespace packtrace {

/// Statistics of an export. Errors are relative to the decoded baked file.
struct Vertex16Report {
  uint64_t geometries = 0, draws = 0, instances = 0, materials = 0;
  uint64_t vertices = 0, triangles = 0;
  uint64_t vertex_bytes = 0, index_bytes = 0, file_bytes = 0;
  uint64_t coarser_geometries = 0;       ///< geometries whose lattice had to lose bits
  double max_position_error = 0.0;       ///< largest over the axes, object units; 0 if coordinates are below 2^24 steps
  double max_normal_error_degrees = 0.0; ///< 0 if the file's encoding is axis24
  double max_uv_error = 0.0;             ///< larger of the two axes
  double max_tangent_error_degrees = 0.0;
};

/// Result of an export.
struct Vertex16Export {
  std::vector<std::byte> bytes; ///< the file; format in docs/vertex16.md
  Vertex16Report report;
};

/// Converts a baked file to vertex and index buffers with 16 bytes per vertex. The bytes depend on the file only.
/// Throws Error(kLimitExceeded) if there are more than 2^32 - 2 vertices or indices, or if a step exceeds the float
/// range;
/// Error(kCancelled).
Vertex16Export export_vertex16(const BakedFile& file, Progress& progress);

} // namespace packtrace
