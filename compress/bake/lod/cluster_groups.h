#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Clusters as runs of triangles.
struct ClusterRuns {
  std::span<const Triangle> points; ///< per triangle, welded position numbers
  std::span<const uint32_t> ends;   ///< cluster i is points[ends[i-1] .. ends[i])
  std::span<const DVec3> centers;   ///< per cluster, any scale
};

inline constexpr uint32_t kGroupTargetClusters = 24;
inline constexpr uint32_t kMaxGroupClusters = 32;

/// A group number for each cluster, 0, 1, ... without gaps: neighbours that share long borders come together, up to
/// kGroupTargetClusters (kMaxGroupClusters where what is left over joins a group). Clusters without neighbours are
/// grouped with those near them. Depends on the input only; n log n in the number of border edges.
std::vector<uint32_t> group_clusters(const ClusterRuns& clusters);

} // namespace packtrace
