#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/clusters/geometry_clusters.h"
#include "compress/format/layout/lod_format.h"

namespace packtrace {

class Progress;

inline constexpr uint32_t kNoGroup = baked::kNoLodGroup;

/// A sphere in lattice steps, relative to the geometry's origin.
struct LodSphere {
  DVec3 center{0.0};
  double radius = 0.0;
};

/// Up to 128 triangles of one kind at one level.
struct LodCluster {
  ClusterRange range; ///< index into ClusterLod::triangles
  uint32_t level = 0;
  uint32_t group = kNoGroup;            ///< group that it belongs to
  uint32_t generating_group = kNoGroup; ///< group that it was simplified from; kNoGroup at level 0
};

/// Clusters that were simplified together.
struct LodGroup {
  uint32_t level = 0;    ///< of its clusters
  bool terminal = false; ///< nothing coarser was made from it: its clusters are part of all coarser levels
  /// Error of the surface simplified from this group, in lattice steps: its maximum distance, both ways, from the part
  /// of level 0 that it represents. At least as large as the errors of all groups below; infinite if terminal.
  double error = 0.0;
  LodSphere sphere; ///< contains the simplified surface and the spheres of all groups below
};

/// The LOD levels of one geometry. For a threshold, a cut contains each cluster whose group's error is above it and
/// whose generating group's error is not. Any cut covers the surface exactly once and without cracks.
struct ClusterLod {
  std::vector<LatticePoint> positions;   ///< the geometry's, then new ones
  std::vector<QuantizedVertex> vertices; ///< the geometry's, then new ones
  std::vector<Triangle> triangles;       ///< vertex numbers
  std::vector<LodCluster> clusters;      ///< level by level; level 0 as in the input
  std::vector<LodGroup> groups;          ///< level by level
  uint32_t level_count = 0;
};

/// Limits for the levels of a geometry.
struct LodLimits {
  uint32_t max_levels = baked::kMaxLodLevels; ///< 1..baked::kMaxLodLevels, including level 0
  /// Per position of the geometry: 1 if no level may move it (SharedBorders). Empty if all may move.
  std::vector<uint8_t> locked;
  bool coarser_normals = true; ///< passed to encode_lod()
};

/// Builds coarser levels until 16 triangles are left, nothing can be simplified further or max_levels is reached.
/// Accepts any triangles. Locked positions and the edges between them are the same in every cut. The result does not
/// depend on the number of threads. Throws Error(kCancelled), Error(kLimitExceeded).
/// @param base the geometry's clusters
/// @param progress advances by the triangles of all levels but the last: up to about twice those of level 0
ClusterLod build_cluster_lod(const QuantizedGeometry& geometry, const GeometryClusters& base, Progress& progress,
                             const LodLimits& limits = {});

} // namespace packtrace
