#include "compress/bake/lod/cluster_lod.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "compress/bake/lod/cluster_groups.h"
#include "compress/bake/lod/lod_group_builder.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/base/progress.h"
#include "pbrt_import/base/weighted_quantile.h"
#include "pbrt_import/scene/bounds.h"

namespace packtrace {
namespace {

constexpr uint32_t kNoCluster = ~0u;
// The share of the triangles that a level keeps. Fine levels take most of the time and space, so they are further
// apart.
constexpr double kKept = 0.47, kKeptWhenMany = 0.33;
constexpr uint64_t kManyTriangles = 2048;
// The last few hundred triangles are reduced faster: each level adds records that would take more space than its
// clusters.
constexpr uint64_t kFewTriangles = 512;
constexpr double kKeptWhenFew = 0.25;
// A group is lost if its error exceeds both of these multiples: of its radius, and of the median group's error.
constexpr double kLossOverRadius = 0.25, kLossOverMedian = 4.0;
constexpr uint64_t kCoarsest = 16;        // levels with at most this many triangles are the last
constexpr double kInflation = 1.0 + 1e-6; // of bounding spheres, to cover rounding errors

/// The share of a level's triangles that the next level keeps.
double kept_of(uint64_t triangles) {
  return triangles > kManyTriangles ? kKeptWhenMany : triangles > kFewTriangles ? kKept : kKeptWhenFew;
}

double distance(DVec3 a, DVec3 b) { return glm::length(a - b); }

/// A sphere that contains all spheres, centred in their common bounding box.
LodSphere enclose(std::span<const LodSphere> spheres) {
  DVec3 lo(std::numeric_limits<double>::infinity()), hi(-lo);
  for (const LodSphere& s : spheres) lo = glm::min(lo, s.center - s.radius), hi = glm::max(hi, s.center + s.radius);
  LodSphere result{0.5 * (lo + hi), 0.0};
  for (const LodSphere& s : spheres)
    result.radius = std::max(result.radius, distance(result.center, s.center) + s.radius);
  result.radius *= kInflation;
  return result;
}

class LodBuilder {
public:
  LodBuilder(const QuantizedGeometry& geometry, Progress& progress, const LodLimits& limits)
      : g_(geometry), progress_(progress), max_levels_(limits.max_levels), locked_for_ever_(limits.locked) {
    // All coarser levels together have fewer than level 0.
    lod_.positions.reserve(2 * geometry.positions.size());
    lod_.positions = geometry.positions;
    lod_.vertices.reserve(2 * geometry.vertices.size());
    lod_.vertices = geometry.vertices;
    for (const TriangleKind& kind : geometry.kinds) seam_of_kind_.push_back(kind.slot);
  }

  ClusterLod run(const GeometryClusters& base) {
    take_base(base);
    lines_ = LineCover(base.triangles, lod_.vertices, lod_.positions.size());
    locked_for_ever_.resize(lod_.positions.size(), 0);
    std::vector<uint32_t> active(lod_.clusters.size());
    for (uint32_t i = 0; i < active.size(); ++i) active[i] = i;
    for (uint32_t level = 0; !active.empty(); ++level) {
      lod_.level_count = level + 1;
      active = build_level(level, active);
    }
    return std::move(lod_);
  }

private:
  void take_base(const GeometryClusters& base) {
    lod_.triangles.reserve(2 * base.triangles.size());
    lod_.triangles = base.triangles;
    triangle_errors_.reserve(2 * base.triangles.size());
    triangle_errors_.assign(base.triangles.size(), 0.0);
    history_ = TriangleHistory(static_cast<uint32_t>(base.triangles.size()));
    for (const ClusterRange& range : base.clusters) lod_.clusters.push_back({range, 0, kNoGroup, kNoGroup});
    cluster_spheres_.resize(lod_.clusters.size());
    tbb::parallel_for(size_t{0}, lod_.clusters.size(),
                      [&](size_t i) { cluster_spheres_[i] = bound(lod_.clusters[i]); });
    DVec3 lo(std::numeric_limits<double>::infinity()), hi(-lo);
    for (const Triangle& t : base.triangles)
      for (int i = 0; i < 3; ++i) {
        const DVec3 p = point(lod_.vertices[t[i]].position);
        lo = glm::min(lo, p), hi = glm::max(hi, p);
      }
    diagonal_ = glm::length(hi - lo);
  }

  DVec3 point(uint32_t position) const { return point(lod_.positions[position]); }
  DVec3 point(const LatticePoint& position) const {
    DVec3 p;
    for (size_t axis = 0; axis < 3; ++axis)
      p[static_cast<int>(axis)] = static_cast<double>(position[axis] - g_.origin[axis]);
    return p;
  }

  LodSphere bound(const LodCluster& cluster) const {
    DVec3 lo(std::numeric_limits<double>::infinity()), hi(-lo);
    const auto for_each_point = [&](const auto& visit) {
      for (uint32_t i = 0; i < cluster.range.triangle_count; ++i)
        for (int corner = 0; corner < 3; ++corner)
          visit(point(lod_.vertices[lod_.triangles[cluster.range.first_triangle + i][corner]].position));
    };
    for_each_point([&](DVec3 p) { lo = glm::min(lo, p), hi = glm::max(hi, p); });
    LodSphere sphere{0.5 * (lo + hi), 0.0};
    double radius2 = 0.0;
    for_each_point([&](DVec3 p) {
      const DVec3 d = p - sphere.center;
      radius2 = std::max(radius2, glm::dot(d, d));
    });
    sphere.radius = kInflation * std::sqrt(radius2);
    return sphere;
  }

  /// Groups the active clusters and simplifies each group. Returns the new clusters.
  std::vector<uint32_t> build_level(uint32_t level, const std::vector<uint32_t>& active) {
    const std::vector<std::vector<uint32_t>> members = form_groups(active);
    const auto first_group = static_cast<uint32_t>(lod_.groups.size());
    lod_.groups.resize(first_group + members.size());
    std::vector<SimplifiedGroup> results(members.size());
    uint64_t all = 0;
    for (const uint32_t number : active) all += lod_.clusters[number].range.triangle_count;
    if (all > kCoarsest && level + 1 < max_levels_) {
      mark_owners(members);
      tbb::parallel_for(size_t{0}, members.size(), [&](size_t i) {
        progress_.check_cancelled();
        uint64_t triangles = 0;
        for (const uint32_t member : members[i]) triangles += lod_.clusters[member].range.triangle_count;
        results[i] = simplify_group(members[i], kept_of(all));
        progress_.advance(triangles);
      });
      keep_lost(members, results);
      give_up(members, results);
    }
    for (size_t i = 0; i < members.size(); ++i)
      finish_group(first_group + static_cast<uint32_t>(i), level, members[i], results[i]);
    return append(level, first_group, results);
  }

  std::vector<std::vector<uint32_t>> form_groups(const std::vector<uint32_t>& active) const {
    std::vector<uint32_t> ends;
    std::vector<DVec3> centers;
    uint32_t count = 0;
    for (const uint32_t number : active) {
      ends.push_back(count += lod_.clusters[number].range.triangle_count);
      centers.push_back(cluster_spheres_[number].center);
    }
    std::vector<Triangle> points(count);
    tbb::parallel_for(size_t{0}, active.size(), [&](size_t i) {
      const ClusterRange& range = lod_.clusters[active[i]].range;
      for (uint32_t k = 0; k < range.triangle_count; ++k)
        points[ends[i] - range.triangle_count + k] = points_of(lod_.triangles[range.first_triangle + k]);
    });
    const std::vector<uint32_t> group_of = group_clusters({points, ends, centers});
    std::vector<std::vector<uint32_t>> members;
    for (size_t i = 0; i < active.size(); ++i) {
      if (group_of[i] >= members.size()) members.resize(group_of[i] + 1);
      members[group_of[i]].push_back(active[i]);
    }
    return members;
  }

  Triangle points_of(const Triangle& t) const {
    return {lod_.vertices[t.x].position, lod_.vertices[t.y].position, lod_.vertices[t.z].position};
  }

  /// Sets owner_ to each position's group, or kShared if it belongs to several.
  void mark_owners(const std::vector<std::vector<uint32_t>>& members) {
    owner_.assign(lod_.positions.size(), kNoCluster);
    tbb::parallel_for(size_t{0}, members.size(), [&](size_t group) {
      for (const uint32_t number : members[group]) {
        const LodCluster& c = lod_.clusters[number];
        for (uint32_t i = 0; i < c.range.triangle_count; ++i)
          for (int corner = 0; corner < 3; ++corner) {
            const Triangle& t = lod_.triangles[c.range.first_triangle + i];
            std::atomic_ref<uint32_t> owner(owner_[lod_.vertices[t[corner]].position]);
            uint32_t expected = owner.load(std::memory_order_relaxed);
            if (expected == group || expected == kShared) continue; // the usual case; an exchange costs several loads
            expected = kNoCluster;
            if (!owner.compare_exchange_strong(expected, static_cast<uint32_t>(group), std::memory_order_relaxed) &&
                expected != group)
              owner.store(kShared, std::memory_order_relaxed);
          }
      }
    });
  }

  /// Keeps the triangles of groups that simplification would destroy while most of the level changes little. Parts of a
  /// few triangles that touch no other group, such as a floor of two, are such groups. Clusters are grouped with others
  /// later, and errors never decrease, so one such error would bind the whole surface in all levels above.
  void keep_lost(const std::vector<std::vector<uint32_t>>& members, std::vector<SimplifiedGroup>& results) const {
    std::vector<std::pair<double, double>> errors; // and numbers of triangles
    double all = 0.0;
    for (const SimplifiedGroup& r : results) {
      errors.emplace_back(r.error, static_cast<double>(r.source_triangles));
      all += errors.back().second;
    }
    const double median = weighted_quantile(errors, 0.5 * all);
    for (size_t i = 0; i < results.size(); ++i) {
      if (results[i].error <= kLossOverMedian * median || results[i].error <= kLossOverRadius * radius_of(members[i]))
        continue;
      results[i] = simplify_group(members[i], 1.0);
    }
  }

  /// Half the diagonal of the box of a group's points.
  double radius_of(const std::vector<uint32_t>& members) const {
    Bounds box;
    for (const uint32_t number : members) {
      const ClusterRange& range = lod_.clusters[number].range;
      for (uint32_t i = 0; i < range.triangle_count; ++i)
        for (int corner = 0; corner < 3; ++corner)
          box.extend(point(lod_.vertices[lod_.triangles[range.first_triangle + i][corner]].position));
    }
    return 0.5 * box.diagonal();
  }

  /// Drops the results of groups that kept too many triangles, so that they become terminal. Where the locks of other
  /// groups held them up and the level shrinks nevertheless, they stay, as groups of the next level lock other points.
  void give_up(const std::vector<std::vector<uint32_t>>& members, std::vector<SimplifiedGroup>& results) const {
    uint64_t before = 0, after = 0;
    for (const SimplifiedGroup& r : results) before += r.source_triangles, after += r.triangles.size();
    const auto too_many = [](uint64_t kept, uint64_t of) {
      return static_cast<double>(kept) > kWorthwhile * static_cast<double>(of);
    };
    const bool shrinks = !too_many(after, before);
    for (size_t i = 0; i < results.size(); ++i)
      if (too_many(results[i].triangles.size(), results[i].source_triangles) && !(shrinks && may_unlock(members[i])))
        results[i] = {};
  }

  /// Whether more corners of the group are locked temporarily, because other groups share them, than permanently.
  bool may_unlock(const std::vector<uint32_t>& members) const {
    uint64_t shared = 0, for_ever = 0;
    for (const uint32_t number : members) {
      const ClusterRange& range = lod_.clusters[number].range;
      for (uint32_t i = 0; i < range.triangle_count; ++i)
        for (int corner = 0; corner < 3; ++corner) {
          const uint32_t p = lod_.vertices[lod_.triangles[range.first_triangle + i][corner]].position;
          if (locked_for_ever_[p] != 0)
            ++for_ever;
          else
            shared += owner_[p] == kShared;
        }
    }
    return shared > for_ever;
  }

  SimplifiedGroup simplify_group(const std::vector<uint32_t>& members, double kept) const {
    LodGroupInput input{g_,     {lod_.positions, lod_.vertices, lod_.triangles, triangle_errors_, history_},
                        {},     seam_of_kind_,
                        owner_, locked_for_ever_,
                        lines_, kept};
    for (const uint32_t number : members) {
      const LodCluster& c = lod_.clusters[number];
      input.clusters.push_back(&c);
      if (c.generating_group != kNoGroup) input.floor = std::max(input.floor, lod_.groups[c.generating_group].error);
    }
    return packtrace::simplify_group(input);
  }

  void finish_group(uint32_t number, uint32_t level, const std::vector<uint32_t>& members,
                    const SimplifiedGroup& result) {
    LodGroup& group = lod_.groups[number];
    group.level = level;
    group.terminal = result.triangles.empty();
    group.error = group.terminal ? std::numeric_limits<double>::infinity() : result.error;
    for (const uint32_t member : members) // errors must not decrease from level to level, as cuts rely on it
      if (const uint32_t below = lod_.clusters[member].generating_group; below != kNoGroup)
        group.error = std::max(group.error, lod_.groups[below].error);
    std::vector<LodSphere> spheres;
    for (const uint32_t member : members) {
      LodCluster& c = lod_.clusters[member];
      c.group = number;
      spheres.push_back(cluster_spheres_[member]);
      if (group.terminal)
        for (uint32_t i = 0; i < c.range.triangle_count; ++i)
          for (int corner = 0; corner < 3; ++corner)
            locked_for_ever_[lod_.vertices[lod_.triangles[c.range.first_triangle + i][corner]].position] = 1;
    }
    group.sphere = enclose(spheres);
    if (group.terminal) return;
    // The surface lies in the sphere and in the geometry's box, so their extents limit the error.
    for (const LatticePoint& p : result.new_positions)
      group.sphere.radius = std::max(group.sphere.radius, kInflation * distance(group.sphere.center, point(p)));
    group.error = std::min({group.error, 2.0 * group.sphere.radius, diagonal_});
  }

  /// Appends the new positions, vertices, triangles and clusters of all groups, in group order. Returns the new
  /// clusters.
  std::vector<uint32_t> append(uint32_t level, uint32_t first_group, const std::vector<SimplifiedGroup>& results) {
    std::vector<uint32_t> added;
    history_.begin_level();
    for (size_t i = 0; i < results.size(); ++i) {
      const SimplifiedGroup& r = results[i];
      const uint32_t group = first_group + static_cast<uint32_t>(i);
      const auto first_position = static_cast<uint32_t>(lod_.positions.size());
      const auto first_vertex = static_cast<uint32_t>(lod_.vertices.size());
      const auto first_triangle = static_cast<uint32_t>(lod_.triangles.size());
      lod_.positions.insert(lod_.positions.end(), r.new_positions.begin(), r.new_positions.end());
      for (QuantizedVertex v : r.new_vertices) {
        if (v.position >= kNewNumber) v.position += first_position - kNewNumber;
        lod_.vertices.push_back(v);
      }
      for (Triangle t : r.triangles) {
        for (int corner = 0; corner < 3; ++corner)
          if (t[corner] >= kNewNumber) t[corner] += first_vertex - kNewNumber;
        lod_.triangles.push_back(t);
      }
      triangle_errors_.insert(triangle_errors_.end(), r.errors.begin(), r.errors.end());
      history_.append(r.below_ends, r.below);
      uint32_t begin = 0;
      for (size_t c = 0; c < r.cluster_ends.size(); ++c) {
        added.push_back(static_cast<uint32_t>(lod_.clusters.size()));
        lod_.clusters.push_back(
            {{first_triangle + begin, r.cluster_ends[c] - begin, r.cluster_kinds[c]}, level + 1, kNoGroup, group});
        cluster_spheres_.push_back(lod_.groups[group].sphere);
        begin = r.cluster_ends[c];
      }
    }
    if (lod_.positions.size() >= kNewNumber || lod_.vertices.size() >= kNewNumber)
      throw Error(ErrorKind::kLimitExceeded, "levels of detail of more than 2^31 vertices in one geometry");
    locked_for_ever_.resize(lod_.positions.size(), 0);
    return added;
  }

  const QuantizedGeometry& g_;
  Progress& progress_;
  const uint32_t max_levels_;
  ClusterLod lod_;
  std::vector<uint32_t> seam_of_kind_;
  double diagonal_ = 0.0;                  ///< of the geometry's bounding box, which contains all levels
  std::vector<LodSphere> cluster_spheres_; ///< the cluster's own at level 0, otherwise the generating group's
  std::vector<double> triangle_errors_;
  TriangleHistory history_;
  std::vector<uint32_t> owner_;
  LineCover lines_;
  std::vector<uint8_t> locked_for_ever_; ///< positions of terminal groups and of LodLimits::locked
};

} // namespace

ClusterLod build_cluster_lod(const QuantizedGeometry& geometry, const GeometryClusters& base, Progress& progress,
                             const LodLimits& limits) {
  return LodBuilder(geometry, progress, limits).run(base);
}

} // namespace packtrace
