#pragma once

#include <cstdint>
#include <vector>

#include "compress/format/cluster/cluster_codec.h"

namespace packtrace {

class BakedFile;

/// Figures of one LOD level of one geometry, or of all geometries with levels.
struct LodLevelUse {
  uint32_t geometries = 0; ///< with clusters of this level
  uint64_t clusters = 0, groups = 0, terminal_groups = 0;
  uint64_t own_triangles = 0; ///< triangles of its clusters
  /// Of the discrete level; geometries with fewer levels count with their last level, here and in the errors.
  uint64_t triangles = 0;
  double max_error = 0.0;              ///< stated, object units
  double max_error_diagonals = 0.0;    ///< the same divided by the diagonal of the geometry's box
  ClusterView::StreamBits stream_bits; ///< payload bits
  uint64_t bytes = 0;                  ///< payload and all records of its clusters, groups and the level itself
};

/// LOD levels of one geometry, or of all geometries.
struct LodTable {
  std::vector<LodLevelUse> levels;
  uint64_t base_triangles() const { return levels.empty() ? 0 : levels.front().triangles; }
  uint64_t bytes() const; ///< sum over all levels
  /// Bytes of all levels per triangle of level 0; 0 without triangles.
  double bytes_per_triangle() const;
};

/// LOD levels of a file. Bytes are those of the resident file (codec none).
struct LodSummary {
  LodTable all;
  struct OfGeometry {
    uint32_t geometry = 0;
    LodTable table;
  };
  std::vector<OfGeometry> by_geometry; ///< geometries with levels
};

LodSummary summarize_lod(const BakedFile& file);

} // namespace packtrace
