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
    levels_[0].among.clear();
    return levels_[0].among;
  }

  /// Measures against those added since begin(). Returns the largest bound; infinite without any.
  /// @param enough (distance, candidate): whether a bound needs to be no smaller
  /// @param noted (candidate, distance): a part of the triangle is that far from it
  template <typename Enough, typename Noted>
  double run(const std::array<DVec3, 3>& triangle, const Enough& enough, const Noted& noted) {
    Level& top = levels_[0];
    largest_ = top.among.empty() ? std::numeric_limits<double>::infinity() : 0.0;
    for (size_t k = 0; k < 3; ++k) top.points[k] = triangle[k], top.among.distances(triangle[k], top.distances[k]);
    work_ += 3 * top.among.size();
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
    TriangleSet among;
    std::array<DVec3, 6> points;
    std::array<std::vector<double>, 6> distances; ///< of each point from each of `among`
  };

  template <typename Enough, typename Noted>
  void cut(size_t depth, const std::array<size_t, 3>& corners, const Enough& enough, const Noted& noted) {
    const Level& level = levels_[depth];
    if (level.among.empty()) return;
    constexpr double kFar = std::numeric_limits<double>::infinity();
    double best = kFar;
    std::array<double, 3> nearest{kFar, kFar, kFar};
    size_t where = 0;
    for (size_t i = 0; i < level.among.size(); ++i) {
      double largest = 0.0;
      for (size_t k = 0; k < 3; ++k) {
        const double d = level.distances[corners[k]][i];
        nearest[k] = std::min(nearest[k], d), largest = std::max(largest, d);
      }
      if (largest < best) best = largest, where = i;
    }
    const double good = kGoodEnough * std::max({nearest[0], nearest[1], nearest[2]});
    if (depth == kMaxCuts || best <= good || enough(best, level.among.number(where))) {
      largest_ = std::max(largest_, best);
      noted(level.among.number(where), best);
      return;
    }
    divide(depth, corners, where, good, enough);
    for (const std::array<size_t, 3>& part : {std::array<size_t, 3>{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}})
      cut(depth + 1, part, enough, noted);
  }

  /// Sets up the next level: what is too far from the triangle serves none of its parts.
  template <typename Enough>
  void divide(size_t depth, const std::array<size_t, 3>& corners, size_t where, double good, const Enough& enough) {
    const Level& from = levels_[depth];
    Level& to = levels_[depth + 1];
    std::array<double, 3> reach{}; // of the triangle from each corner
    for (size_t k = 0; k < 3; ++k) {
      to.points[k] = from.points[corners[k]];
      to.distances[k].clear();
    }
    to.among.clear();
    for (size_t k = 0; k < 3; ++k) to.points[3 + k] = 0.5 * (to.points[k] + to.points[(k + 1) % 3]);
    for (size_t k = 0; k < 3; ++k)
      reach[k] = std::max(glm::length(to.points[(k + 1) % 3] - to.points[k]),
                          glm::length(to.points[(k + 2) % 3] - to.points[k]));
    for (size_t i = 0; i < from.among.size(); ++i) {
      double least = 0.0;
      for (size_t k = 0; k < 3; ++k) least = std::max(least, from.distances[corners[k]][i] - reach[k]);
      if (i != where && least > good && !enough(least, from.among.number(i))) continue;
      to.among.add(from.among, i);
      for (size_t k = 0; k < 3; ++k) to.distances[k].push_back(from.distances[corners[k]][i]);
    }
    for (size_t k = 3; k < 6; ++k) to.among.distances(to.points[k], to.distances[k]);
    work_ += from.among.size() + 3 * to.among.size();
  }

  std::array<Level, kMaxCuts + 1> levels_;
  double largest_ = 0.0;
  size_t work_ = 0;
};

} // namespace packtrace
