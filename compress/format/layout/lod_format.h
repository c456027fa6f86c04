#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <type_traits>

namespace packtrace::baked {

inline constexpr uint32_t kNoLodGroup = ~0u;
/// Maximum number of levels of one geometry, including level 0.
inline constexpr uint32_t kMaxLodLevels = 32;

/// One LOD level of a geometry that has several (docs/cluster_lod.md). Records are ordered by base, then level. The
/// discrete level consists of its clusters and of the clusters of terminal groups on finer levels.
struct LodLevelRecord {
  uint64_t first_group; ///< into the group section
  uint64_t first_link;  ///< into the link section; one per cluster of `geometry`, in order
  uint64_t triangles;   ///< triangles of the discrete level
  uint32_t base;        ///< level-0 geometry, which instances reference
  uint32_t level;       ///< 0, 1, ... below kMaxLodLevels
  /// Geometry that holds its clusters: the base at level 0, else a separate one with the base's lattice and slots.
  uint32_t geometry;
  uint32_t group_count; ///< number of groups of its clusters
  /// Error of the discrete level against level 0, object units: largest finite group error of the finer levels, or 0.
  float error;
  uint32_t reserved;
};
static_assert(sizeof(LodLevelRecord) == 48 && std::is_trivially_copyable_v<LodLevelRecord>);

/// A group: clusters of one level that were simplified together (docs/cluster_lod.md). Object space. Values are rounded
/// such that a sphere still contains the spheres of the finer groups that it was made from, and its error is not below
/// theirs.
struct LodGroupRecord {
  /// Of a sphere that contains its clusters and all finer clusters that they were made from.
  std::array<float, 3> center;
  float radius;
  /// Error against level 0 of the clusters made from this group, object units; infinite: terminal, nothing coarser was
  /// made.
  float error;
  uint32_t level; ///< level of its clusters
};
static_assert(sizeof(LodGroupRecord) == 24 && std::is_trivially_copyable_v<LodGroupRecord>);

/// Groups of a cluster with LOD levels. A cut contains the cluster if its group's error is above the threshold and its
/// generating group's error is not.
struct LodLinkRecord {
  uint32_t group;            ///< group that the cluster belongs to, numbered within the geometry
  uint32_t generating_group; ///< group that the cluster was made from; kNoLodGroup at level 0, which means error 0
};
static_assert(sizeof(LodLinkRecord) == 8 && std::is_trivially_copyable_v<LodLinkRecord>);

/// Whether `outer` contains `inner`; false if a number is not finite.
inline bool holds_sphere(const LodGroupRecord& outer, const LodGroupRecord& inner) {
  double squared = 0.0;
  for (size_t axis = 0; axis < 3; ++axis) {
    const double d = double{outer.center[axis]} - double{inner.center[axis]};
    squared += d * d;
  }
  return std::sqrt(squared) + double{inner.radius} <= double{outer.radius};
}

} // namespace packtrace::baked

namespace packtrace {

/// LOD levels of one geometry. All spans are empty if it has none.
struct LodView {
  std::span<const baked::LodLevelRecord> levels; ///< 0, 1, ...
  std::span<const baked::LodGroupRecord> groups; ///< level by level; links number them from 0
  std::span<const baked::LodLinkRecord> links;   ///< level by level, cluster by cluster

  /// Groups of the clusters of `level`.
  std::span<const baked::LodGroupRecord> groups_of(size_t level) const {
    return groups.subspan(static_cast<size_t>(levels[level].first_group - levels[0].first_group),
                          levels[level].group_count);
  }
  /// Links of the clusters of `level`, in the order of the clusters.
  std::span<const baked::LodLinkRecord> links_of(size_t level) const {
    const auto first = static_cast<size_t>(levels[level].first_link - levels[0].first_link);
    const auto end = level + 1 < levels.size()
                         ? static_cast<size_t>(levels[level + 1].first_link - levels[0].first_link)
                         : links.size();
    return links.subspan(first, end - first);
  }
};

} // namespace packtrace
