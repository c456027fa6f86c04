#include "tests/benchmarks/lod_benchmark_groups.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <set>
#include <utility>

#include <tbb/parallel_for.h>

#include "tests/compress/lod/surface_distance.h"

namespace packtrace {
namespace {

constexpr double kMeasurable = 1e-6;   // lattice steps; smaller measured distances are rounding errors
constexpr size_t kSamples = 3000;      // per group
constexpr size_t kBaseSamples = 64;    // per level 0 cluster, besides its corners and one point per triangle
constexpr double kBorderSamples = 8.0; // parts of a side at a cluster's border

void make_unique(std::vector<uint32_t>& numbers) {
  std::sort(numbers.begin(), numbers.end());
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
}

} // namespace

void append_points(const ClusterLod& lod, const LodCluster& cluster, std::vector<Triangle>& out) {
  for (uint32_t i = 0; i < cluster.range.triangle_count; ++i) {
    const Triangle& t = lod.triangles[cluster.range.first_triangle + i];
    out.emplace_back(lod.vertices[t.x].position, lod.vertices[t.y].position, lod.vertices[t.z].position);
  }
}

/// A point of level 0 and the groups that can represent it at the current level.
struct GroupSurfaces::Sample {
  DVec3 point;
  std::vector<uint32_t> groups;
  double excess = 0.0;   ///< by which the point is further from each of them than they state
  double measured = 0.0; ///< distance from the only one
};

/// A group's part of a level: what was made from it, or its own clusters if it is terminal.
struct GroupSurfaces::Holder {
  double error; ///< stated
  std::vector<Triangle> triangles;
  std::unique_ptr<SurfaceDistance> distance;
};

GroupSurfaces::GroupSurfaces(const ClusterLod& lod, const std::vector<DVec3>& points)
    : lod_(lod), points_(points), made_(lod.groups.size()), base_(lod.groups.size()), below_(lod.groups.size()),
      above_(lod.groups.size()), measured_(lod.groups.size()) {
  for (uint32_t i = 0; i < lod.clusters.size(); ++i) {
    const LodCluster& c = lod.clusters[i];
    if (c.generating_group == kNoGroup) {
      base_[c.group].push_back(i);
      add_samples(i);
    } else {
      made_[c.generating_group].push_back(i);
      below_[c.group].push_back(c.generating_group);
      above_[c.generating_group].push_back(c.group);
    }
  }
  for (uint32_t i = 0; i < base_.size(); ++i) { // groups are ordered by level
    if (lod.groups[i].terminal) above_[i] = {i};
    make_unique(above_[i]);
    make_unique(below_[i]);
    for (const uint32_t group : below_[i]) base_[i].insert(base_[i].end(), base_[group].begin(), base_[group].end());
    make_unique(base_[i]);
  }
}

GroupSurfaces::~GroupSurfaces() = default;

/// Adds the corners of the cluster's triangles, points of its border and points within triangles, evenly over their
/// area. Leaves degenerate triangles out, as a group need not represent them.
void GroupSurfaces::add_samples(uint32_t cluster) {
  const std::vector<uint32_t> groups{lod_.clusters[cluster].group};
  double total = 0.0;
  std::vector<double> areas;
  std::vector<uint32_t> corners;
  const std::vector<Triangle> triangles = triangles_of({cluster});
  for (const Triangle& t : triangles) {
    areas.push_back(glm::length(glm::cross(points_[t.y] - points_[t.x], points_[t.z] - points_[t.x])));
    total += areas.back();
    if (t.x != t.y && t.y != t.z && t.z != t.x) corners.insert(corners.end(), {t.x, t.y, t.z});
  }
  make_unique(corners);
  for (const uint32_t corner : corners) samples_.push_back({points_[corner], groups});
  std::set<std::pair<uint32_t, uint32_t>> sides;
  for (const Triangle& t : triangles)
    for (int i = 0; i < 3; ++i) sides.emplace(t[i], t[(i + 1) % 3]);
  for (const auto& [from, to] : sides) {
    if (sides.contains({to, from})) continue;
    for (double k = 1.0; k < kBorderSamples; ++k)
      samples_.push_back({points_[from] + k / kBorderSamples * (points_[to] - points_[from]), groups});
  }
  for (size_t i = 0; i < triangles.size(); ++i) {
    if (!(areas[i] > 0.0)) continue;
    const Triangle& t = triangles[i];
    const auto count = 1 + static_cast<size_t>(areas[i] / total * static_cast<double>(kBaseSamples));
    for (size_t k = 0; k < count; ++k) {
      double u = std::fmod(0.5 + static_cast<double>(k) * 0.7548776662466927, 1.0);
      double v = std::fmod(0.25 + static_cast<double>(k) * 0.5698402909980532, 1.0);
      if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
      samples_.push_back(
          {points_[t.x] + u * (points_[t.y] - points_[t.x]) + v * (points_[t.z] - points_[t.x]), groups});
    }
  }
}

std::vector<Triangle> GroupSurfaces::triangles_of(const std::vector<uint32_t>& clusters) const {
  std::vector<Triangle> triangles;
  for (const uint32_t cluster : clusters) append_points(lod_, lod_.clusters[cluster], triangles);
  return triangles;
}

/// Per group: its part of the level, if it has any.
std::vector<GroupSurfaces::Holder> GroupSurfaces::find_holders(uint32_t level) const {
  std::vector<Holder> holders(lod_.groups.size());
  for (const LodCluster& c : lod_.clusters)
    if (lod_.groups[c.group].terminal && lod_.groups[c.group].level < level)
      append_points(lod_, c, holders[c.group].triangles);
  for (uint32_t i = 0; i < holders.size(); ++i) {
    const LodGroup& g = lod_.groups[i];
    Holder& holder = holders[i];
    holder.error = g.terminal ? 0.0 : g.error;
    for (const uint32_t below : below_[i]) holder.error = std::max(holder.error, lod_.groups[below].error);
    if (!g.terminal && g.level + 1 == level) holder.triangles = triangles_of(made_[i]);
    if (!holder.triangles.empty()) holder.distance = std::make_unique<SurfaceDistance>(points_, holder.triangles);
  }
  return holders;
}

/// Finds which groups can represent each sample at the level, and what that says of their errors.
void GroupSurfaces::measure_samples(uint32_t level) {
  const std::vector<Holder> holders = find_holders(level);
  tbb::parallel_for(size_t{0}, samples_.size(), [&](size_t i) {
    Sample& sample = samples_[i];
    std::vector<uint32_t> candidates, possible;
    for (const uint32_t g : sample.groups)
      if (level == 1)
        candidates.push_back(g);
      else
        candidates.insert(candidates.end(), above_[g].begin(), above_[g].end());
    make_unique(candidates);
    double least_excess = std::numeric_limits<double>::infinity();
    for (const uint32_t g : candidates) {
      const double d = (*holders[g].distance)(sample.point), excess = d - holders[g].error * (1.0 + 1e-6) - kMeasurable;
      least_excess = std::min(least_excess, excess);
      if (excess <= 0.0) possible.push_back(g), sample.measured = d;
    }
    sample.excess = std::max(0.0, least_excess);
    if (!possible.empty())
      std::swap(sample.groups, possible);
    else
      sample.groups = candidates;
  });
  for (const Sample& sample : samples_) {
    excess_ = std::max(excess_, sample.excess);
    if (sample.groups.size() == 1 && sample.excess == 0.0)
      measured_[sample.groups[0]] = std::max(measured_[sample.groups[0]], sample.measured);
  }
}

std::vector<double> GroupSurfaces::ratios(uint32_t level) {
  if (level == 0) return {};
  std::vector<double> result, before = measured_;
  measure_samples(level);
  for_each_group(level, [&](uint32_t group) {
    const std::vector<Triangle> base = triangles_of(base_[group]);
    const double to =
        surface_distance(points_, triangles_of(made_[group]), SurfaceDistance(points_, base), kSamples).max;
    excess_ = std::max(excess_, to - lod_.groups[group].error * (1.0 + 1e-6));
    before[group] = std::max(measured_[group], to);
    if (before[group] > kMeasurable) result.push_back(lod_.groups[group].error / before[group]);
  });
  measured_ = std::move(before); // what was measured for terminal groups is not kept
  return result;
}

std::vector<double> GroupSurfaces::ratios_to_largest(uint32_t level) {
  std::vector<double> result;
  for_each_group(level, [&](uint32_t group) {
    for (const uint32_t below : below_[group]) measured_[group] = std::max(measured_[group], measured_[below]);
    if (measured_[group] > kMeasurable) result.push_back(lod_.groups[group].error / measured_[group]);
  });
  return result;
}

} // namespace packtrace
