#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "compress/bake/lod/bound/surface_side.h"
#include "compress/bake/lod/bound/triangle_set.h"
#include "compress/bake/lod/bound/triangle_subtraction.h"

namespace packtrace {

/// Bounds the distance of a triangle from the nearest of several triangles. Distance from a triangle is convex, so its
/// maximum is at a corner. Parts over one triangle are measured there; where that is not enough for all of it, the
/// triangle is subdivided into four while that lowers the bound considerably.
class TriangleRefiner {
public:
  /// Empties the set of triangles to measure against and returns it, for the caller to fill.
  TriangleSet& begin() {
    levels_[0].kept.clear();
    return levels_[0].kept;
  }

  /// Measures against the candidates of `side`.
  void begin(const SurfaceSide& side) {
    TriangleSet& among = begin();
    for (const uint32_t t : side.candidates()) among.add(side.surface(), t);
  }

  /// The largest distance of a corner of `triangle` from the triangles added since begin(); 0 if there are none.
  double measure_corners(const std::array<DVec3, 3>& triangle) {
    Level& top = levels_[0];
    top.among = &top.kept;
    for (size_t k = 0; k < 3; ++k) top.points[k] = triangle[k];
    measure(top, 0);
    return top.kept.empty() ? 0.0 : top.kept.nearest(top.distances[0], top.distances[1], top.distances[2]).least;
  }

  /// Returns an upper bound for the triangle of measure_corners(); infinite if there is nothing to measure against.
  /// @param enough (distance, candidate): whether that bound is small enough
  /// @param noted (candidate, distance): called once per part of the triangle that lies within the distance of the
  /// candidate
  template <typename Enough, typename Noted>
  double run(const Enough& enough, const Noted& noted) {
    if (levels_[0].kept.empty()) return std::numeric_limits<double>::infinity();
    largest_ = proven_ = 0.0;
    limit_ = std::numeric_limits<double>::infinity();
    is_exhausted_ = false;
    parts_.clear();
    cut(0, {0, 1, 2}, enough);
    if (const double loose = largest_; is_exhausted_ && loose > kLoose * proven_) {
      std::swap(parts_, loose_parts_);
      parts_.clear();
      largest_ = 0.0, limit_ = loose;
      cut(0, {0, 1, 2}, enough);
      if (largest_ >= loose) largest_ = loose, std::swap(parts_, loose_parts_);
    }
    for (const auto& [number, distance] : parts_) noted(number, distance);
    return largest_;
  }

  /// Number of point-triangle distances in all runs so far.
  size_t work() const { return work_; }

private:
  static constexpr size_t kMaxCuts = 5;
  static constexpr size_t kSubtractedCuts = 2; // parts that were cut more often are not subtracted from
  // Subtracts only where the bound is this many times the lower bound: mostly tangential distance.
  static constexpr double kLeak = 8.0;
  // If the first run's bound exceeds this many times the lower bound that it found, there is a second run.
  static constexpr double kLoose = 2.0;
  static constexpr size_t kMaxLookedAt = 512;  // triangles of a set that is subtracted from
  static constexpr size_t kMaxSubtracted = 48; // triangles near enough to be subtracted
  static constexpr size_t kMaxRestCuts = 4;    // of what is left after subtraction
  static constexpr double kGoodEnough = 1.1;   // stops within this factor of the lower bound
  static constexpr double kRounding = 1e-6;    // rounding error of differences of distances, in grid steps

  /// One subdivision level: the corners of a part and the midpoints of its sides, with their distances.
  struct Level {
    const TriangleSet* among; ///< kept, or the set of a level above
    std::array<DVec3, 6> points;
    std::array<const double*, 6> distances; ///< of each point from each triangle of `among`; padded
    TriangleSet kept;
    std::array<std::vector<double>, 6> measured; ///< distances computed at this level
  };

  /// Measures three points, starting at `first`.
  void measure(Level& level, size_t first) {
    std::array<double*, 3> rows;
    for (size_t k = 0; k < 3; ++k) {
      std::vector<double>& row = level.measured[first + k];
      if (row.size() < level.among->padded_size()) row.resize(level.among->padded_size());
      level.distances[first + k] = rows[k] = row.data();
    }
    level.among->distances(std::span(level.points).subspan(first, 3), rows);
    work_ += 3 * level.among->size();
  }

  /// Bounds a part of the triangle, subdividing it while that helps. Appends the final parts to parts_.
  template <typename Enough>
  void cut(size_t depth, const std::array<size_t, 3>& corners, const Enough& enough) {
    const Level& level = levels_[depth];
    const NearestTriangle nearest =
        level.among->nearest(level.distances[corners[0]], level.distances[corners[1]], level.distances[corners[2]]);
    proven_ = std::max(proven_, nearest.least);
    const double good = kGoodEnough * (is_second_run() ? proven_ : nearest.least);
    const uint32_t number = level.among->number(nearest.place);
    const bool is_good = nearest.distance <= good || enough(nearest.distance, number);
    if (depth == kMaxCuts || is_good) {
      is_exhausted_ |= !is_good;
      largest_ = std::max(largest_, nearest.distance);
      parts_.emplace_back(number, nearest.distance);
      return;
    }
    const double leak = is_second_run() ? kLoose * proven_ : kLeak * nearest.least;
    if (depth <= kSubtractedCuts && nearest.distance > leak && covers(depth, corners, good, enough)) return;
    divide(depth, corners, nearest.place, good, enough);
    for (const std::array<size_t, 3>& part : {std::array<size_t, 3>{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}})
      if (largest_ < limit_) cut(depth + 1, part, enough);
  }

  bool is_second_run() const { return limit_ != std::numeric_limits<double>::infinity(); }

  /// Bounds a part of the triangle by those of the set that are near enough, each for what lies over it. Appends them
  /// to parts_ and returns true if nothing is left but what is near enough to one of them.
  template <typename Enough>
  bool covers(size_t depth, const std::array<size_t, 3>& corners, double good, const Enough& enough) {
    const Level& level = levels_[depth];
    const TriangleSet& among = *level.among;
    if (among.size() > kMaxLookedAt) return false;
    const std::array<DVec3, 3> part = {level.points[corners[0]], level.points[corners[1]], level.points[corners[2]]};
    const auto accept = [&](double distance, uint32_t number) { return distance <= good || enough(distance, number); };
    subtraction_.begin(part);
    taken_.clear();
    find_near(level, corners, part, accept);
    work_ += among.size();
    if (near_.size() > kMaxSubtracted) return false;
    for (size_t k = 0; k < near_.size() && !subtraction_.rest().empty(); ++k) {
      const uint32_t number = among.number(near_[k]);
      subtraction_.subtract(
          among.corners(near_[k]), [&](double distance) { return accept(distance, number); },
          [&](double distance) { taken_.emplace_back(number, distance); });
      if (subtraction_.rest().size() > TriangleSubtraction::kMaxRest) return false;
    }
    if (taken_.empty()) return false;
    for (const TriangleSubtraction::Polygon& rest : subtraction_.rest())
      if (!takes_rest(among, rest, accept, 0)) return false;
    for (const auto& [number, distance] : taken_) largest_ = std::max(largest_, distance);
    parts_.insert(parts_.end(), taken_.begin(), taken_.end());
    return true;
  }

  /// Whether each part of a polygon is at an accepted distance from one of near_. Appends those to taken_.
  template <typename Accept>
  bool takes_rest(const TriangleSet& among, const TriangleSubtraction::Polygon& rest, const Accept& accept,
                  size_t depth) {
    work_ += near_.size();
    for (const uint32_t near : near_) {
      const uint32_t number = among.number(near);
      const double distance = TriangleSubtraction::distance(
          rest, among.corners(near), [&](double of_corner) { return accept(of_corner, number); });
      if (!accept(distance, number)) continue;
      taken_.emplace_back(number, distance);
      return true;
    }
    if (depth == kMaxRestCuts) return false;
    for (uint32_t i = 0; i < rest.count; ++i) {
      const DVec3& corner = rest.corners[i];
      const auto reaches = [&](uint32_t near) {
        const std::array<DVec3, 3> c = among.corners(near);
        return accept(glm::length(corner - nearest_point(corner, c[0], c[1], c[2])), among.number(near));
      };
      work_ += near_.size();
      if (std::any_of(near_.begin(), near_.end(), reaches)) continue;
      double least = std::numeric_limits<double>::infinity();
      for (size_t k = 0; k < among.size(); ++k) {
        const std::array<DVec3, 3> c = among.corners(k);
        least = std::min(least, glm::length(corner - nearest_point(corner, c[0], c[1], c[2])));
      }
      proven_ = std::max(proven_, least);
      return false;
    }
    const auto [one, other] = TriangleSubtraction::halves(rest);
    return takes_rest(among, one, accept, depth + 1) && takes_rest(among, other, accept, depth + 1);
  }

  /// Distances from each corner to the farthest point of a part.
  static std::array<double, 3> reaches(const std::array<DVec3, 3>& part) {
    std::array<double, 3> reach{};
    for (size_t k = 0; k < 3; ++k)
      reach[k] = std::max(glm::length(part[(k + 1) % 3] - part[k]), glm::length(part[(k + 2) % 3] - part[k]));
    return reach;
  }

  /// Lower bound of the distance of any point of a part from triangle i of the level.
  static double least_distance(const Level& level, const std::array<size_t, 3>& corners,
                               const std::array<double, 3>& reach, uint32_t i) {
    return std::max({level.distances[corners[0]][i] - reach[0], level.distances[corners[1]][i] - reach[1],
                     level.distances[corners[2]][i] - reach[2]});
  }

  /// Sets near_ to the triangles of the level that can be at an accepted distance from a point of the part.
  template <typename Accept>
  void find_near(const Level& level, const std::array<size_t, 3>& corners, const std::array<DVec3, 3>& part,
                 const Accept& accept) {
    const std::array<double, 3> reach = reaches(part);
    near_.clear();
    for (uint32_t i = 0; i < level.among->size(); ++i) {
      const double least = least_distance(level, corners, reach, i);
      if (accept(least - kRounding, level.among->number(i))) near_.push_back(i);
    }
  }

  /// Sets up the next level. Triangles that are too far away cannot be nearest for any part; they are dropped from the
  /// set if at least half of it goes.
  template <typename Enough>
  void divide(size_t depth, const std::array<size_t, 3>& corners, size_t where, double good, const Enough& enough) {
    const Level& from = levels_[depth];
    Level& to = levels_[depth + 1];
    for (size_t k = 0; k < 3; ++k) to.points[k] = from.points[corners[k]], to.distances[k] = from.distances[corners[k]];
    for (size_t k = 0; k < 3; ++k) to.points[3 + k] = 0.5 * (to.points[k] + to.points[(k + 1) % 3]);
    const std::array<double, 3> reach = reaches({to.points[0], to.points[1], to.points[2]});
    near_.clear();
    for (uint32_t i = 0; i < from.among->size(); ++i) {
      const double least = least_distance(from, corners, reach, i);
      if (i == where || least <= good || enough(least, from.among->number(i))) near_.push_back(i);
    }
    work_ += from.among->size();
    to.among = from.among;
    if (2 * near_.size() <= from.among->size()) keep_near(*from.among, to);
    measure(to, 3);
  }

  void keep_near(const TriangleSet& from, Level& to) {
    to.kept.clear();
    for (const uint32_t i : near_) to.kept.add(from, i);
    to.among = &to.kept;
    for (size_t k = 0; k < 3; ++k) {
      std::vector<double>& kept = to.measured[k];
      kept.assign(to.kept.padded_size(), std::numeric_limits<double>::infinity());
      for (size_t i = 0; i < near_.size(); ++i) kept[i] = to.distances[k][near_[i]];
      to.distances[k] = kept.data();
    }
  }

  std::array<Level, kMaxCuts + 1> levels_;
  std::vector<uint32_t> near_;
  TriangleSubtraction subtraction_;
  std::vector<std::pair<uint32_t, double>> taken_;               ///< triangle numbers with distances
  std::vector<std::pair<uint32_t, double>> parts_, loose_parts_; ///< candidates with distances
  double largest_ = 0.0;                                         ///< of parts_
  double proven_ = 0.0;                                          ///< lower bound of the triangle's distance
  double limit_ = 0.0;                                           ///< bound of the first run; infinite during it
  bool is_exhausted_ = false;                                    ///< whether parts were too small to be subdivided
  size_t work_ = 0;
};

} // namespace packtrace
