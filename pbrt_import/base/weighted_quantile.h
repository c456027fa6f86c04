#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>

namespace packtrace {

/// Returns the largest value such that all smaller ones together weigh less than `weight`; 0 if there is none. With
/// half of all weights, this is the weighted median. Takes O(n) time on average.
/// @param values pairs of value and weight, which is not negative; reordered
inline double weighted_quantile(std::span<std::pair<double, double>> values, double weight) {
  if (!(weight > 0.0)) return 0.0;
  while (values.size() > 1) {
    const size_t half = values.size() / 2;
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(half), values.end());
    double below = 0.0;
    for (const auto& value : values.first(half)) below += value.second;
    if (below < weight) {
      weight -= below;
      values = values.subspan(half);
    } else {
      values = values.first(half);
    }
  }
  return values.empty() ? 0.0 : values[0].first;
}

} // namespace packtrace
