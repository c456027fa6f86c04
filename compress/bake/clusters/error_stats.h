#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

namespace packtrace {

inline constexpr size_t kErrorGrain = 4096; // fixed, so that sums are grouped equally for any thread count

/// Maximum and sum over many items.
struct ErrorStats {
  double max = 0.0, sum = 0.0, squares = 0.0;
  uint64_t count = 0;
  void add(double error) { max = std::max(max, error), sum += error, squares += error * error, ++count; }
  static ErrorStats join(ErrorStats a, const ErrorStats& b) {
    return {std::max(a.max, b.max), a.sum + b.sum, a.squares + b.squares, a.count + b.count};
  }
};

/// Accumulates per_item(i, stats) over [0, count); bitwise equal for any thread count.
template <typename PerItem>
ErrorStats accumulate_errors(size_t count, const PerItem& per_item) {
  return tbb::parallel_deterministic_reduce(
      tbb::blocked_range<size_t>(0, count, kErrorGrain), ErrorStats{},
      [&](const tbb::blocked_range<size_t>& range, ErrorStats stats) {
        for (size_t i = range.begin(); i < range.end(); ++i) per_item(i, stats);
        return stats;
      },
      ErrorStats::join);
}

/// Calls per_item(i) for i in [0, count), in parallel.
template <typename PerItem>
void for_each_item(size_t count, const PerItem& per_item) {
  tbb::parallel_for(tbb::blocked_range<size_t>(0, count, kErrorGrain), [&](const tbb::blocked_range<size_t>& range) {
    for (size_t i = range.begin(); i < range.end(); ++i) per_item(i);
  });
}

} // namespace packtrace
