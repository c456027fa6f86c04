#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace packtrace {

/// Two costs of one point; less is better in both.
struct Costs {
  double x = 0.0, y = 0.0;
};

/// Indices of the points that no other point dominates, in ascending order of x. A point dominates another one if it is
/// at most as large in both costs and smaller in one. Points with a NaN are not on the front.
std::vector<size_t> pareto_front(std::span<const Costs> points);

/// Index in `points` of the front's point farthest below the straight line between the front's ends, with both axes
/// logarithmic. None if the front has fewer than three points, if a cost on it is not positive and finite, or if no
/// point lies below the line.
/// @param front result of pareto_front() for the points
std::optional<size_t> knee_of(std::span<const Costs> points, std::span<const size_t> front);

} // namespace packtrace
