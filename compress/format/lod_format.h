#pragma once

#include <array>
#include <cstdint>
#include <type_traits>

namespace packtrace::baked {

inline constexpr uint32_t kNoLodGroup = ~0u;

/// Clusters of one level that were simplified together (docs/cluster_lod.md). Object space. Rounded such that spheres
/// still hold those of the groups below and errors are no smaller than theirs.
struct LodGroupRecord {
  std::array<float, 3> center; ///< of a ball that holds everything that the group was ever made from
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

} // namespace packtrace::baked
