#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

namespace packtrace::baked {

inline constexpr uint32_t kNoLodGroup = ~0u;
/// Maximum number of levels of one geometry, including level 0.
inline constexpr uint32_t kMaxLodLevels = 32;
/// Maximum number of groups of one level.
inline constexpr uint32_t kMaxLodGroups = 65535;

/// One LOD level of a geometry that has several (docs/cluster_lod.md). Records are ordered by base, then level. The
/// discrete level consists of its clusters and of the clusters of terminal groups on finer levels.
struct LodLevelRecord {
  uint32_t first_group; ///< into the group section
  uint32_t first_link;  ///< into the link section; one per cluster of `geometry`, in order
  uint32_t triangles;   ///< triangles of the discrete level
  uint32_t base;        ///< level-0 geometry, which instances reference
  /// Geometry that holds its clusters: the base at level 0, else a separate one with the base's lattice and slots.
  uint32_t geometry;
  uint16_t group_count; ///< number of groups of its clusters
  uint16_t level;       ///< 0, 1, ... below kMaxLodLevels
  /// Error of the discrete level against level 0, object units: largest finite group error of the finer levels, or 0.
  float error;
};
static_assert(sizeof(LodLevelRecord) == 28 && std::is_trivially_copyable_v<LodLevelRecord>);

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

/// Groups of a cluster with LOD levels; LodLink is the decoded form.
struct LodLinkRecord {
  uint16_t group;            ///< numbered within the cluster's level
  uint16_t generating_group; ///< numbered within the level below; 0 at level 0
};
static_assert(sizeof(LodLinkRecord) == 4 && std::is_trivially_copyable_v<LodLinkRecord>);

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

/// Groups of a cluster. A cut contains the cluster if its group's error is above the threshold and its generating
/// group's error is not. Groups of a geometry are numbered from 0, level by level.
struct LodLink {
  uint32_t group; ///< group that the cluster belongs to
  /// Group that the cluster was made from; kNoLodGroup at level 0, which means error 0.
  uint32_t generating_group;
};

/// LOD levels of one geometry. All spans are empty if it has none.
struct LodView {
  std::span<const baked::LodLevelRecord> levels;      ///< 0, 1, ...
  std::span<const baked::LodGroupRecord> groups;      ///< level by level; links number them from 0
  std::span<const baked::LodLinkRecord> link_records; ///< level by level, cluster by cluster

  /// Groups of the clusters of `level`.
  std::span<const baked::LodGroupRecord> groups_of(size_t level) const {
    return groups.subspan(first_group(level), levels[level].group_count);
  }
  /// Number of a level's first group within the geometry.
  uint32_t first_group(size_t level) const { return levels[level].first_group - levels[0].first_group; }
  /// Links of the clusters of `level`, in the order of the clusters.
  std::vector<LodLink> links_of(size_t level) const {
    std::vector<LodLink> links;
    append_links(level, links);
    return links;
  }
  /// Links of all clusters, level by level.
  std::vector<LodLink> links() const {
    std::vector<LodLink> all;
    all.reserve(link_records.size());
    for (size_t level = 0; level < levels.size(); ++level) append_links(level, all);
    return all;
  }

private:
  void append_links(size_t level, std::vector<LodLink>& to) const {
    const size_t begin = levels[level].first_link - levels[0].first_link;
    const size_t end =
        level + 1 < levels.size() ? levels[level + 1].first_link - levels[0].first_link : link_records.size();
    const uint32_t own = first_group(level), below = level > 0 ? first_group(level - 1) : 0;
    for (const baked::LodLinkRecord& link : link_records.subspan(begin, end - begin))
      to.push_back({own + link.group, level > 0 ? below + link.generating_group : baked::kNoLodGroup});
  }
};

} // namespace packtrace
