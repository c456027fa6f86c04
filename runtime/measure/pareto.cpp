#include "runtime/measure/pareto.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace packtrace {

std::vector<size_t> pareto_front(std::span<const Costs> points) {
  std::vector<size_t> order;
  for (size_t i = 0; i < points.size(); ++i)
    if (!std::isnan(points[i].x) && !std::isnan(points[i].y)) order.push_back(i);
  std::ranges::stable_sort(order, [&](size_t a, size_t b) {
    return points[a].x != points[b].x ? points[a].x < points[b].x : points[a].y < points[b].y;
  });
  std::vector<size_t> front;
  for (const size_t i : order) {
    const bool equal = !front.empty() && points[i].x == points[front.back()].x && points[i].y == points[front.back()].y;
    if (front.empty() || points[i].y < points[front.back()].y || equal) front.push_back(i);
  }
  return front;
}

std::optional<size_t> knee_of(std::span<const Costs> points, std::span<const size_t> front) {
  if (front.size() < 3) return std::nullopt;
  const auto usable = [](double cost) { return cost > 0.0 && std::isfinite(cost); };
  if (!std::ranges::all_of(front, [&](size_t i) { return usable(points[i].x) && usable(points[i].y); }))
    return std::nullopt;
  const auto at = [&](size_t i) { return Costs{std::log(points[i].x), std::log(points[i].y)}; };
  const Costs first = at(front.front()), last = at(front.back());
  const double width = last.x - first.x, height = first.y - last.y; // both at least 0
  if (!(width > 0.0) || !(height > 0.0)) return std::nullopt;
  std::optional<size_t> knee;
  double deepest = 1e-9; // relative to the front's extent
  for (const size_t i : front) {
    const Costs p = at(i);
    const double depth = 1.0 - (p.x - first.x) / width - (p.y - last.y) / height;
    if (depth > deepest) deepest = depth, knee = i;
  }
  return knee;
}

} // namespace packtrace
