#pragma once

#include <cstdint>
#include <vector>

#include "compress/format/cluster/cluster_codec.h"

namespace packtrace {

class BakedFile;

/// One level of one geometry, or of all geometries that have levels.
struct LodLevelUse {
  uint32_t geometries = 0; ///< with clusters of this level
  uint64_t clusters = 0, groups = 0, terminal_groups = 0;
  uint64_t own_triangles = 0; ///< of its clusters
  uint64_t triangles = 0; ///< of the discrete level; here and for errors geometries that end before count as their last
  double max_error = 0.0; ///< stated, object units
  double max_error_diagonals = 0.0;    ///< the same over the diagonal of its geometry's box
  ClusterView::StreamBits stream_bits; ///< of the payload
  uint64_t bytes = 0;                  ///< payload and records of its clusters, groups and of itself
};

/// Levels of one geometry, or of all.
struct LodTable {
  std::vector<LodLevelUse> levels;
  uint64_t base_triangles() const { return levels.empty() ? 0 : levels.front().triangles; }
  uint64_t bytes() const; ///< of all levels
  /// Of all levels, for each triangle of level 0; 0 without triangles.
  double bytes_per_triangle() const;
};

/// Levels of detail in a file, bytes as with codec none.
struct LodSummary {
  LodTable all;
  struct OfGeometry {
    uint32_t geometry = 0;
    LodTable table;
  };
  std::vector<OfGeometry> by_geometry; ///< those that have levels
};

LodSummary summarize_lod(const BakedFile& file);

} // namespace packtrace
