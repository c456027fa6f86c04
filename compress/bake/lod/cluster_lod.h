#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/clusters/geometry_clusters.h"
#include "compress/format/layout/lod_format.h"

namespace packtrace {

class Progress;

inline constexpr uint32_t kNoGroup = baked::kNoLodGroup;

/// A ball in lattice steps from the geometry's origin.
struct LodSphere {
  DVec3 center{0.0};
  double radius = 0.0;
};

/// Up to 128 triangles of one kind at one level.
struct LodCluster {
  ClusterRange range; ///< of ClusterLod::triangles
  uint32_t level = 0;
  uint32_t group = kNoGroup;            ///< it is part of
  uint32_t generating_group = kNoGroup; ///< it was simplified from; none at level 0
};

/// Clusters that were simplified together.
struct LodGroup {
  uint32_t level = 0;    ///< of its clusters
  bool terminal = false; ///< nothing coarser was made from it: its clusters stand for themselves at all coarser levels
  /// Of what was made from it, in lattice steps: no point of that surface is further than this from the part of level 0
  /// that it stands for, nor the other way round. At least as large as that of every group below. Infinite if terminal.
  double error = 0.0;
  LodSphere sphere; ///< holds what was made from it and the spheres of all groups below: all that it was ever made from
};

/// The levels of one geometry. A cut takes, for some threshold, each cluster whose group's error is above it and whose
/// generating group's is not; whatever the threshold, the cut covers the surface once and has no crack.
struct ClusterLod {
  std::vector<LatticePoint> positions;   ///< those of the geometry, then new ones
  std::vector<QuantizedVertex> vertices; ///< those of the geometry, then new ones
  std::vector<Triangle> triangles;       ///< into vertices
  std::vector<LodCluster> clusters;      ///< level by level; level 0 as given
  std::vector<LodGroup> groups;          ///< level by level
  uint32_t level_count = 0;
};

/// What limits the levels of a geometry, besides its triangles.
struct LodLimits {
  uint32_t max_levels = baked::kMaxLodLevels; ///< 1..baked::kMaxLodLevels, level 0 counted
  /// Per position of the geometry: 1 where no level may move it (SharedBorders). Empty: all may move.
  std::vector<uint8_t> locked;
};

/// Builds coarser levels until 16 triangles are left, nothing that can be simplified, or max_levels. Any triangles will
/// do. Locked positions and the edges between them are the same in every cut.
/// Same result for any thread count. Throws Error(kCancelled), Error(kLimitExceeded).
/// @param base the geometry's clusters
/// @param progress advances by triangles of all levels but the last: up to about twice those of level 0
ClusterLod build_cluster_lod(const QuantizedGeometry& geometry, const GeometryClusters& base, Progress& progress,
                             const LodLimits& limits = {});

/// Triangles of the discrete level: its clusters, and those of terminal groups below it.
uint64_t level_triangles(const ClusterLod& lod, uint32_t level);

} // namespace packtrace
