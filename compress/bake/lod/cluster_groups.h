#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Clusters as ranges of triangles.
struct ClusterRuns {
  std::span<const Triangle> points; ///< per triangle, numbers of welded positions
  std::span<const uint32_t> ends;   ///< cluster i has points[ends[i-1] .. ends[i])
  std::span<const DVec3> centers;   ///< per cluster, in any unit
};

inline constexpr uint32_t kGroupTargetClusters = 24;
inline constexpr uint32_t kMaxGroupClusters = 32;

/// Returns a group number per cluster, numbered from 0 without gaps. Neighbours with long common borders are grouped,
/// up to kGroupTargetClusters (kMaxGroupClusters where a small remainder joins a group). Clusters without neighbours
/// are grouped with nearby ones. Deterministic. Takes n log n time in the number of border edges.
std::vector<uint32_t> group_clusters(const ClusterRuns& clusters);

} // namespace packtrace
