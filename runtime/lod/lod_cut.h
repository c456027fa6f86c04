#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/lod/lod_geometry.h"
#include "runtime/lod/lod_metric.h"

namespace packtrace {

/// Levels that an instance's cut can have, both included: every cluster of it that is of no terminal group has a level
/// in [min, max], every other one at most max.
struct LodRange {
  uint32_t min = 0, max = 0;
};

/// The lower end of lod_range().
inline uint32_t first_level(const LodGeometry& geometry, const AllowedErrors& allowed) {
  const std::span<const LodLevel> levels = geometry.levels();
  uint32_t level = 0;
  while (level < geometry.last_level() && levels[level].largest_error <= allowed.near) ++level;
  return level;
}

/// From the ball around the geometry and per-level facts only, so it costs a few operations a level and holds for any
/// transform: level l is passed over where even its largest error passes at the near side of the ball, and not exceeded
/// where its smallest does not pass at d = |M C - eye| + s (R - 2 r), r its smallest ball's radius.
/// @param allowed of allowed_errors(), with the other arguments as there
LodRange lod_range(const LodGeometry& geometry, const AllowedErrors& allowed, double near, double error_per_distance,
                   const BallDistance& distance, double stretch);

/// Groups that pass, one bit a rank, lowest bit first: 64 ranks a word.
inline size_t cut_words(const LodGeometry& geometry) { return (size_t{geometry.rank_count()} + 63) / 64; }

inline bool rank_passes(std::span<const uint64_t> passed, uint32_t rank) {
  return (passed[rank / 64] >> (rank % 64)) & 1;
}

/// The first `count` ranks pass, no others.
void set_prefix(std::span<uint64_t> passed, uint32_t count);

/// Which groups pass for an instance: each is asked by itself, but for those that `allowed` decides.
/// @param passed cut_words() words
void cut_of_instance(const LodGeometry& geometry, const InstanceMetric& metric, const AllowedErrors& allowed,
                     std::span<uint64_t> passed);

/// Of cut_of_instance(), without storing it.
struct CutCount {
  uint64_t triangles = 0;
  uint32_t prefix = 0; ///< so many of the first ranks pass
};
CutCount count_cut(const LodGeometry& geometry, const InstanceMetric& metric, const AllowedErrors& allowed);

/// What a cut holds.
struct CutSize {
  uint64_t triangles = 0;
  uint32_t clusters = 0;
};
CutSize size_of_cut(const LodGeometry& geometry, std::span<const uint64_t> passed);

/// The clusters of a cut, ascending: those whose group does not pass and whose generating group does, or is none.
std::vector<uint32_t> clusters_of_cut(const LodGeometry& geometry, std::span<const uint64_t> passed);

/// The largest error of the groups that pass; 0 if none does. Object units.
double error_of_cut(const LodGeometry& geometry, std::span<const uint64_t> passed);

} // namespace packtrace
