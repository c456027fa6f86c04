#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <functional>
#include <vector>

#include <tbb/global_control.h>

namespace packtrace {

/// CPU time of this thread, in seconds.
inline double thread_cpu_seconds() {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_nsec) * 1e-9;
}

/// Calls functions in turn, with one thread, and returns the median of each one's CPU time in milliseconds.
/// @param repeats calls per function that count, at least 1, after two that do not
inline std::vector<double> median_cpu_ms(const std::vector<std::function<void()>>& functions, uint32_t repeats) {
  constexpr uint32_t kWarmUp = 2;
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  std::vector<std::vector<double>> samples(functions.size());
  for (uint32_t repeat = 0; repeat < repeats + kWarmUp; ++repeat)
    for (size_t i = 0; i < functions.size(); ++i) {
      const double before = thread_cpu_seconds();
      functions[i]();
      if (repeat >= kWarmUp) samples[i].push_back((thread_cpu_seconds() - before) * 1e3);
    }
  std::vector<double> medians;
  for (std::vector<double>& s : samples) {
    const auto middle = s.begin() + static_cast<ptrdiff_t>(s.size() / 2);
    std::nth_element(s.begin(), middle, s.end());
    medians.push_back(*middle);
  }
  return medians;
}

} // namespace packtrace
