#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/lod/lod_geometry.h"
#include "runtime/lod/lod_metric.h"

namespace packtrace {

/// The levels that an instance's cut can have, inclusive: its clusters have levels up to max, and at least min unless
/// they belong to a terminal group.
struct LodRange {
  uint32_t min = 0, max = 0;
};

/// LodRange::min of lod_range().
inline uint32_t first_level(const LodGeometry& geometry, const AllowedErrors& allowed) {
  const std::span<const LodLevel> levels = geometry.levels();
  uint32_t level = 0;
  while (level < geometry.last_level() && levels[level].largest_error <= allowed.near) ++level;
  return level;
}

/// Bounds the levels of an instance's cut from the sphere around the geometry and per-level data only. Takes a few
/// operations per level and holds for any affine transform. Level l is below min if even its largest error passes at
/// the near side of the sphere; l is max if its smallest error does not pass at d = |M C - eye| + s (R - 2 r), with r
/// the smallest radius of the level's groups.
/// @param allowed result of allowed_errors() for the other arguments
LodRange lod_range(const LodGeometry& geometry, const AllowedErrors& allowed, double near, double error_per_distance,
                   const BallDistance& distance, double stretch);

/// Number of 64-bit words of a cut: one bit per rank, set if the group passes, lowest bit first.
inline size_t cut_words(const LodGeometry& geometry) { return (size_t{geometry.rank_count()} + 63) / 64; }

inline bool rank_passes(std::span<const uint64_t> passed, uint32_t rank) {
  return (passed[rank / 64] >> (rank % 64)) & 1;
}

/// Sets the bits of the first `count` ranks and clears all others.
void set_prefix(std::span<uint64_t> passed, uint32_t count);

/// Computes which groups pass for an instance. Groups that `allowed` does not decide are tested one by one.
/// @param passed cut_words() words
void cut_of_instance(const LodGeometry& geometry, const InstanceMetric& metric, const AllowedErrors& allowed,
                     std::span<uint64_t> passed);

/// The size of cut_of_instance(), without storing the cut.
struct CutCount {
  uint64_t triangles = 0;
  uint32_t prefix = 0; ///< number of leading ranks that all pass
};
CutCount count_cut(const LodGeometry& geometry, const InstanceMetric& metric, const AllowedErrors& allowed);

/// The contents of a cut.
struct CutSize {
  uint64_t triangles = 0;
  uint32_t clusters = 0;
};
CutSize size_of_cut(const LodGeometry& geometry, std::span<const uint64_t> passed);

/// The clusters of a cut, ascending: their group does not pass, and their generating group passes or does not exist.
std::vector<uint32_t> clusters_of_cut(const LodGeometry& geometry, std::span<const uint64_t> passed);

/// The largest error of the groups that pass, in object units; 0 if none passes.
double error_of_cut(const LodGeometry& geometry, std::span<const uint64_t> passed);

} // namespace packtrace
