#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <type_traits>

namespace packtrace::baked {

inline constexpr uint32_t kNoLodGroup = ~0u;
/// Levels of one geometry at most, level 0 counted.
inline constexpr uint32_t kMaxLodLevels = 32;

/// One level of detail of a geometry that has several (docs/cluster_lod.md). Ordered by base, then level.
/// The discrete level is its clusters and those of terminal groups of the levels below it.
struct LodLevelRecord {
  uint64_t first_group; ///< into the group section
  uint64_t first_link;  ///< into the link section; one per cluster of `geometry`, in order
  uint64_t triangles;   ///< of the discrete level
  uint32_t base;        ///< the geometry whose level this is; instances are of that one
  uint32_t level;       ///< 0, 1, ... below kMaxLodLevels
  uint32_t
      geometry; ///< holds its clusters: the base at level 0, else one of its own, with the base's lattice and slots
  uint32_t group_count; ///< of its clusters
  float error; ///< of the discrete level against level 0, object units: the largest of finite groups below, or 0
  uint32_t reserved;
};
static_assert(sizeof(LodLevelRecord) == 48 && std::is_trivially_copyable_v<LodLevelRecord>);

/// Clusters of one level that were simplified together (docs/cluster_lod.md). Object space. Rounded such that spheres
/// still hold those of the groups below and errors are no smaller than theirs.
struct LodGroupRecord {
  std::array<float, 3> center; ///< of a ball that holds its clusters and all they were ever made from
  float radius;
  float error; ///< of what was made from it against level 0, object units; infinite: terminal, nothing coarser was made
  uint32_t level; ///< of its clusters
};
static_assert(sizeof(LodGroupRecord) == 24 && std::is_trivially_copyable_v<LodGroupRecord>);

/// Of a cluster that has levels of detail. A cut takes it where its group's error is too large and its generating
/// group's is not.
struct LodLinkRecord {
  uint32_t group;            ///< it is part of, within the geometry's groups
  uint32_t generating_group; ///< it was simplified from; kNoLodGroup at level 0: error 0
};
static_assert(sizeof(LodLinkRecord) == 8 && std::is_trivially_copyable_v<LodLinkRecord>);

/// Whether one ball lies in the other; false where a number is not finite.
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

/// The levels of one geometry as they lie in a file. All spans are empty where it has none.
struct LodView {
  std::span<const baked::LodLevelRecord> levels; ///< 0, 1, ...
  std::span<const baked::LodGroupRecord> groups; ///< level by level; links number them from 0
  std::span<const baked::LodLinkRecord> links;   ///< level by level, cluster by cluster

  /// Groups of the level's clusters.
  std::span<const baked::LodGroupRecord> groups_of(size_t level) const {
    return groups.subspan(static_cast<size_t>(levels[level].first_group - levels[0].first_group),
                          levels[level].group_count);
  }
  /// By cluster of the level's geometry.
  std::span<const baked::LodLinkRecord> links_of(size_t level) const {
    const auto first = static_cast<size_t>(levels[level].first_link - levels[0].first_link);
    const auto end = level + 1 < levels.size()
                         ? static_cast<size_t>(levels[level + 1].first_link - levels[0].first_link)
                         : links.size();
    return links.subspan(first, end - first);
  }
};

} // namespace packtrace
