#include "runtime/lod/lod_cut.h"

#include <algorithm>
#include <bit>

namespace packtrace {

LodRange lod_range(const LodGeometry& geometry, const AllowedErrors& allowed, double near, double error_per_distance,
                   const BallDistance& distance, double stretch) {
  const std::span<const LodLevel> levels = geometry.levels();
  LodRange range;
  range.min = first_level(geometry, allowed);
  const double radius = geometry.ball().radius;
  for (range.max = range.min; range.max < geometry.last_level(); ++range.max) {
    const LodLevel& level = levels[range.max];
    if (level.smallest_error > allowed.far) break;
    const double d = distance.center + stretch * (radius - 2.0 * level.smallest_radius) + distance.slack;
    if (level.smallest_error * stretch > error_per_distance * std::max(near, d) * (1.0 + 0x1p-40)) break;
  }
  return range;
}

void set_prefix(std::span<uint64_t> passed, uint32_t count) {
  for (size_t word = 0; word < passed.size(); ++word) {
    const size_t first = 64 * word;
    passed[word] = count >= first + 64 ? ~uint64_t{0} : count > first ? (uint64_t{1} << (count - first)) - 1 : 0;
  }
}

void cut_of_instance(const LodGeometry& geometry, const InstanceMetric& metric, const AllowedErrors& allowed,
                     std::span<uint64_t> passed) {
  const uint32_t certain = geometry.ranks_up_to(allowed.near), end = geometry.ranks_up_to(allowed.far);
  set_prefix(passed, certain);
  for (uint32_t rank = certain; rank < end; ++rank)
    passed[rank / 64] |= uint64_t{metric.passes(geometry.ranks(), rank)} << (rank % 64);
}

CutCount count_cut(const LodGeometry& geometry, const InstanceMetric& metric, const AllowedErrors& allowed) {
  const uint32_t certain = geometry.ranks_up_to(allowed.near), end = geometry.ranks_up_to(allowed.far);
  const LodRanks& ranks = geometry.ranks();
  uint32_t prefix = certain;
  while (prefix < end && metric.passes(ranks, prefix)) ++prefix;
  int64_t saved = 0;
  for (uint32_t rank = prefix + 1; rank < end; ++rank)
    saved += metric.passes(ranks, rank) ? ranks.saved_triangles[rank] : 0;
  return {static_cast<uint64_t>(static_cast<int64_t>(geometry.triangles_of_prefix(prefix)) - saved), prefix};
}

namespace {

/// Calls visit(rank) for each set bit, ascending.
template <typename Visit>
void for_each_passed(std::span<const uint64_t> passed, const Visit& visit) {
  for (size_t word = 0; word < passed.size(); ++word)
    for (uint64_t bits = passed[word]; bits != 0; bits &= bits - 1)
      visit(64 * word + static_cast<size_t>(std::countr_zero(bits)));
}

} // namespace

CutSize size_of_cut(const LodGeometry& geometry, std::span<const uint64_t> passed) {
  auto triangles = static_cast<int64_t>(geometry.triangles_of_prefix(0));
  auto clusters = static_cast<int64_t>(geometry.clusters_of_prefix(0));
  for_each_passed(passed, [&](size_t rank) {
    triangles -= geometry.ranks().saved_triangles[rank];
    clusters -= geometry.ranks().saved_clusters[rank];
  });
  return {static_cast<uint64_t>(triangles), static_cast<uint32_t>(clusters)};
}

std::vector<uint32_t> clusters_of_cut(const LodGeometry& geometry, std::span<const uint64_t> passed) {
  std::vector<uint32_t> clusters;
  const auto passes = [&](uint32_t group) {
    const uint32_t rank = geometry.rank_of_group(group);
    return rank != kNoRank && rank_passes(passed, rank);
  };
  for (uint32_t i = 0; i < geometry.links().size(); ++i) {
    const LodLink& link = geometry.links()[i];
    if (passes(link.group)) continue;
    if (link.generating_group == baked::kNoLodGroup || passes(link.generating_group)) clusters.push_back(i);
  }
  return clusters;
}

double error_of_cut(const LodGeometry& geometry, std::span<const uint64_t> passed) {
  for (size_t word = passed.size(); word-- > 0;)
    if (passed[word] != 0)
      return geometry.ranks().error[64 * word + 63 - static_cast<size_t>(std::countl_zero(passed[word]))];
  return 0.0;
}

} // namespace packtrace
