#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "compress/bake/lod/surface_side.h"
#include "compress/bake/lod/triangle_set.h"

namespace packtrace {

/// Bounds the distance of a triangle from the nearest of several, cutting it in four as long as that makes the bound
/// much smaller: the distance from one triangle is convex, so the three corners bound it for all of it.
class TriangleRefiner {
public:
  /// Empty, for those that the next run() is to measure against.
  TriangleSet& begin() {
    levels_[0].kept.clear();
    return levels_[0].kept;
  }

  /// Measures against those added since begin(). Returns the largest bound; infinite without any.
  /// @param enough (distance, candidate): whether a bound needs to be no smaller
  /// @param noted (candidate, distance): a part of the triangle is that far from it
  template <typename Enough, typename Noted>
  double run(const std::array<DVec3, 3>& triangle, const Enough& enough, const Noted& noted) {
    Level& top = levels_[0];
    top.among = &top.kept;
    largest_ = top.kept.empty() ? std::numeric_limits<double>::infinity() : 0.0;
    for (size_t k = 0; k < 3; ++k) top.points[k] = triangle[k], measure(top, k);
    cut(0, {0, 1, 2}, enough, noted);
    return largest_;
  }

  /// The same, against the candidates of `side`.
  template <typename Enough, typename Noted>
  double run(const std::array<DVec3, 3>& triangle, const SurfaceSide& side, const Enough& enough, const Noted& noted) {
    TriangleSet& among = begin();
    for (const uint32_t t : side.candidates()) among.add(side.surface(), t);
    return run(triangle, enough, noted);
  }

  /// How many distances of triangles all runs took so far.
  size_t work() const { return work_; }

private:
  static constexpr size_t kMaxCuts = 5;
  static constexpr double kGoodEnough = 1.25; // of what cutting could still gain

  /// What a triangle is cut into: its corners and the middles of its sides, with their distances.
  struct Level {
    const TriangleSet* among; ///< kept, or that of a level above
    std::array<DVec3, 6> points;
    std::array<const double*, 6> distances; ///< of each point from each of `among`; padded
    TriangleSet kept;
    std::array<std::vector<double>, 6> measured; ///< what distances of this level's own are
  };

  void measure(Level& level, size_t point) {
    level.among->distances(level.points[point], level.measured[point]);
    work_ += level.among->size();
    level.distances[point] = level.measured[point].data();
  }

  template <typename Enough, typename Noted>
  void cut(size_t depth, const std::array<size_t, 3>& corners, const Enough& enough, const Noted& noted) {
    const Level& level = levels_[depth];
    if (level.among->empty()) return;
    const NearestTriangle nearest =
        level.among->nearest(level.distances[corners[0]], level.distances[corners[1]], level.distances[corners[2]]);
    const double good = kGoodEnough * nearest.least;
    const uint32_t number = level.among->number(nearest.place);
    if (depth == kMaxCuts || nearest.distance <= good || enough(nearest.distance, number)) {
      largest_ = std::max(largest_, nearest.distance);
      noted(number, nearest.distance);
      return;
    }
    divide(depth, corners, nearest.place, good, enough);
    for (const std::array<size_t, 3>& part : {std::array<size_t, 3>{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}})
      cut(depth + 1, part, enough, noted);
  }

  /// Sets up the next level: what is too far from the triangle serves none of its parts, and is left out where it is
  /// much.
  template <typename Enough>
  void divide(size_t depth, const std::array<size_t, 3>& corners, size_t where, double good, const Enough& enough) {
    const Level& from = levels_[depth];
    Level& to = levels_[depth + 1];
    std::array<double, 3> reach{}; // of the triangle from each corner
    for (size_t k = 0; k < 3; ++k) to.points[k] = from.points[corners[k]], to.distances[k] = from.distances[corners[k]];
    for (size_t k = 0; k < 3; ++k) to.points[3 + k] = 0.5 * (to.points[k] + to.points[(k + 1) % 3]);
    for (size_t k = 0; k < 3; ++k)
      reach[k] = std::max(glm::length(to.points[(k + 1) % 3] - to.points[k]),
                          glm::length(to.points[(k + 2) % 3] - to.points[k]));
    near_.clear();
    for (uint32_t i = 0; i < from.among->size(); ++i) {
      const double least =
          std::max({to.distances[0][i] - reach[0], to.distances[1][i] - reach[1], to.distances[2][i] - reach[2]});
      if (i == where || least <= good || enough(least, from.among->number(i))) near_.push_back(i);
    }
    work_ += from.among->size();
    to.among = from.among;
    if (2 * near_.size() <= from.among->size()) keep_near(*from.among, to);
    for (size_t k = 3; k < 6; ++k) measure(to, k);
  }

  void keep_near(const TriangleSet& from, Level& to) {
    to.kept.clear();
    for (const uint32_t i : near_) to.kept.add(from, i);
    to.among = &to.kept;
    for (size_t k = 0; k < 3; ++k) {
      std::vector<double>& kept = to.measured[k];
      kept.assign(to.kept.padded_size(), TriangleSet::kFar);
      for (size_t i = 0; i < near_.size(); ++i) kept[i] = to.distances[k][near_[i]];
      to.distances[k] = kept.data();
    }
  }

  std::array<Level, kMaxCuts + 1> levels_;
  std::vector<uint32_t> near_;
  double largest_ = 0.0;
  size_t work_ = 0;
};

} // namespace packtrace
