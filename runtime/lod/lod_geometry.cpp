#include "runtime/lod/lod_geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kInflation = 1.0 + 0x1p-40; // of bounding spheres, to cover rounding errors

[[noreturn]] void reject(const std::string& why) { throw Error(ErrorKind::kInput, "levels of detail: " + why); }

bool terminal(const baked::LodGroupRecord& group) { return std::isinf(group.error); }

DVec3 center_of(const baked::LodGroupRecord& g) { return {g.center[0], g.center[1], g.center[2]}; }

/// A sphere around the spheres, centred in their bounding box.
LodBall enclose(std::span<const LodBall> balls) {
  DVec3 lo(kInfinite), hi(-kInfinite);
  for (const LodBall& b : balls) lo = glm::min(lo, b.center - b.radius), hi = glm::max(hi, b.center + b.radius);
  LodBall result{0.5 * (lo + hi), 0.0};
  for (const LodBall& b : balls)
    result.radius = std::max(result.radius, glm::length(result.center - b.center) + b.radius);
  result.radius *= kInflation;
  return result;
}

} // namespace

LodGeometry::LodGeometry(std::span<const baked::LodGroupRecord> groups, std::span<const LodLink> links,
                         std::span<const uint32_t> cluster_triangles)
    : links_(links.begin(), links.end()), cluster_triangles_(cluster_triangles.begin(), cluster_triangles.end()) {
  if (groups.empty() || links.empty()) reject("no groups or no clusters");
  if (links.size() != cluster_triangles.size()) reject("not as many triangle counts as clusters");
  if (groups.size() >= baked::kNoLodGroup || links.size() > static_cast<size_t>(INT32_MAX))
    reject("too many groups or clusters");
  check_groups(groups);
  check_links(groups);
  enlarge_balls(groups);
  count_levels(groups);
  rank_groups(groups);
  ball_ = enclose(balls_);
  for (const LodBall& b : balls_) reach_ = std::max(reach_, glm::length(b.center) + b.radius);
  reach_ = std::max(reach_, glm::length(ball_.center) + ball_.radius);
  balls_ = {};
}

void LodGeometry::check_groups(std::span<const baked::LodGroupRecord> groups) {
  uint32_t level = 0;
  if (groups[0].level != 0) reject("the first group is not of level 0");
  for (const baked::LodGroupRecord& g : groups) {
    if (g.level != level && g.level != level + 1) reject("groups are not level by level");
    level = g.level;
    if (level >= baked::kMaxLodLevels) reject("more than 32 levels");
    for (const float c : g.center)
      if (!std::isfinite(c)) reject("a group's center is not finite");
    if (!(g.radius >= 0.0f) || std::isinf(g.radius)) reject("a group's radius is not finite");
    if (!(g.error >= 0.0f)) reject("a group's error is negative or not a number");
  }
  levels_.resize(level + 1);
}

void LodGeometry::check_links(std::span<const baked::LodGroupRecord> groups) {
  for (const LodLink& link : links_) {
    if (link.group >= groups.size()) reject("a cluster is of no group");
    const baked::LodGroupRecord& own = groups[link.group];
    if ((own.level == 0) != (link.generating_group == baked::kNoLodGroup))
      reject("a cluster of level 0 was made from a group, or one above it from none");
    if (link.generating_group == baked::kNoLodGroup) continue;
    if (link.generating_group >= groups.size()) reject("a cluster was made from no group");
    const baked::LodGroupRecord& below = groups[link.generating_group];
    if (below.level + 1 != own.level) reject("a cluster was not made from a group one level below");
    if (terminal(below)) reject("a cluster was made from a terminal group");
    if (below.error > own.error) reject("a group's error is below that of a group below it");
  }
}

void LodGeometry::enlarge_balls(std::span<const baked::LodGroupRecord> groups) {
  for (const baked::LodGroupRecord& g : groups) balls_.push_back({center_of(g), g.radius * kInflation});
  // In order of level, so that the groups below are done first.
  std::vector<uint32_t> order(links_.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    return groups[links_[a].group].level < groups[links_[b].group].level;
  });
  for (const uint32_t cluster : order) {
    const LodLink& link = links_[cluster];
    if (link.generating_group == baked::kNoLodGroup) continue;
    LodBall& own = balls_[link.group];
    const LodBall& below = balls_[link.generating_group];
    const double needed = glm::length(own.center - below.center) + below.radius;
    if (needed > own.radius) own.radius = needed * kInflation;
  }
}

void LodGeometry::count_levels(std::span<const baked::LodGroupRecord> groups) {
  for (LodLevel& level : levels_) level.smallest_error = level.smallest_radius = kInfinite;
  for (uint32_t i = 0; i < groups.size(); ++i) {
    LodLevel& level = levels_[groups[i].level];
    if (level.group_count++ == 0) level.first_group = i;
    if (terminal(groups[i])) continue;
    const double error = groups[i].error;
    level.largest_error = std::max(level.largest_error, error);
    level.smallest_error = std::min(level.smallest_error, error);
    level.smallest_radius = std::min(level.smallest_radius, balls_[i].radius);
  }
  for (size_t i = 0; i < links_.size(); ++i) {
    const baked::LodGroupRecord& group = groups[links_[i].group];
    ++levels_[group.level].cluster_count;
    const size_t end = terminal(group) ? levels_.size() : group.level + 1;
    for (size_t level = group.level; level < end; ++level) levels_[level].triangles += cluster_triangles_[i];
  }
  for (size_t i = 0; i < levels_.size(); ++i) {
    if (std::isinf(levels_[i].smallest_radius)) levels_[i].smallest_radius = 0.0;
    if (i > 0) levels_[i].error = std::max(levels_[i - 1].error, levels_[i - 1].largest_error);
  }
}

void LodGeometry::rank_groups(std::span<const baked::LodGroupRecord> groups) {
  for (uint32_t i = 0; i < groups.size(); ++i)
    if (!terminal(groups[i])) ranks_.group.push_back(i);
  std::stable_sort(ranks_.group.begin(), ranks_.group.end(),
                   [&](uint32_t a, uint32_t b) { return groups[a].error < groups[b].error; });
  const size_t count = ranks_.group.size();
  rank_of_group_.assign(groups.size(), kNoRank);
  ranks_.saved_triangles.assign(count, 0);
  ranks_.saved_clusters.assign(count, 0);
  for (uint32_t rank = 0; rank < count; ++rank) {
    const uint32_t i = ranks_.group[rank];
    rank_of_group_[i] = rank;
    ranks_.center_x.push_back(balls_[i].center.x);
    ranks_.center_y.push_back(balls_[i].center.y);
    ranks_.center_z.push_back(balls_[i].center.z);
    ranks_.radius.push_back(balls_[i].radius);
    ranks_.error.push_back(groups[i].error);
    ranks_.level.push_back(groups[i].level);
  }
  uint32_t finest_clusters = 0;
  for (size_t i = 0; i < links_.size(); ++i) {
    const int64_t triangles = cluster_triangles_[i];
    if (const uint32_t rank = rank_of_group_[links_[i].group]; rank != kNoRank)
      ranks_.saved_triangles[rank] += triangles, ++ranks_.saved_clusters[rank];
    if (links_[i].generating_group == baked::kNoLodGroup) {
      ++finest_clusters;
    } else {
      const uint32_t rank = rank_of_group_[links_[i].generating_group];
      ranks_.saved_triangles[rank] -= triangles, --ranks_.saved_clusters[rank];
    }
  }
  auto triangles = static_cast<int64_t>(levels_[0].triangles);
  auto clusters = static_cast<int64_t>(finest_clusters);
  for (size_t rank = 0; rank <= count; ++rank) {
    triangles_of_prefix_.push_back(static_cast<uint64_t>(triangles));
    clusters_of_prefix_.push_back(static_cast<uint32_t>(clusters));
    if (rank < count) triangles -= ranks_.saved_triangles[rank], clusters -= ranks_.saved_clusters[rank];
  }
}

uint32_t LodGeometry::ranks_up_to(double error) const {
  const auto end = std::upper_bound(ranks_.error.begin(), ranks_.error.end(), error);
  return static_cast<uint32_t>(end - ranks_.error.begin());
}

namespace {

LodStep step_of_prefix(const LodGeometry& geometry, uint32_t passed) {
  const double error = passed == 0 ? 0.0 : geometry.ranks().error[passed - 1];
  return {error, passed, geometry.triangles_of_prefix(passed), geometry.clusters_of_prefix(passed)};
}

} // namespace

std::vector<LodStep> ratio_steps(const LodGeometry& geometry, double ratio) {
  const uint32_t count = geometry.rank_count();
  std::vector<LodStep> steps{step_of_prefix(geometry, geometry.ranks_up_to(0.0))};
  for (uint32_t passed = steps[0].passed; passed < count;) {
    passed = geometry.ranks_up_to(geometry.ranks().error[passed]); // groups of equal error pass together
    const auto triangles = static_cast<double>(geometry.triangles_of_prefix(passed));
    if (passed == count || triangles * ratio <= static_cast<double>(steps.back().triangles))
      steps.push_back(step_of_prefix(geometry, passed));
  }
  return steps;
}

uint32_t coarsest_step_of_prefix(std::span<const LodStep> steps, uint32_t passed) {
  const auto end =
      std::upper_bound(steps.begin(), steps.end(), passed, [](uint32_t p, const LodStep& s) { return p < s.passed; });
  return end == steps.begin() ? 0 : static_cast<uint32_t>(end - steps.begin()) - 1;
}

uint32_t coarsest_step(std::span<const LodStep> steps, double error) {
  const auto end =
      std::upper_bound(steps.begin(), steps.end(), error, [](double e, const LodStep& s) { return e < s.error; });
  return end == steps.begin() ? 0 : static_cast<uint32_t>(end - steps.begin()) - 1;
}

} // namespace packtrace
