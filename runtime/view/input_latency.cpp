#include "runtime/view/input_latency.h"

#include <algorithm>
#include <cmath>

namespace packtrace {
namespace {

constexpr size_t kMaxLatencies = 1024;

} // namespace

void InputLatency::add(double ms) {
  if (last_ms_.size() < kMaxLatencies)
    last_ms_.push_back(ms);
  else
    last_ms_[count_ % kMaxLatencies] = ms;
  ++count_;
}

double InputLatency::percentile_ms(double fraction) const {
  if (last_ms_.empty()) return 0.0;
  std::vector<double> sorted = last_ms_;
  std::ranges::sort(sorted);
  const double rank = std::ceil(fraction * static_cast<double>(sorted.size())) - 1.0;
  return sorted[static_cast<size_t>(std::max(0.0, rank))];
}

} // namespace packtrace
