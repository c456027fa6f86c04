#include "pbrt_import/base/progress.h"

#include "pbrt_import/base/error.h"

namespace packtrace {

std::atomic<bool> Progress::cancelled_{false};

void Progress::begin(std::string_view phase, uint64_t total) {
  check_cancelled();
  phase_ = phase;
  total_ = total;
  done_.store(0, std::memory_order_relaxed);
  if (observer_) observer_(phase_, 0, total_);
}

void Progress::advance(uint64_t units) {
  check_cancelled();
  const uint64_t done = done_.fetch_add(units, std::memory_order_relaxed) + units;
  if (observer_) observer_(phase_, done, total_);
}

void Progress::check_cancelled() const {
  if (cancelled()) throw Error(ErrorKind::kCancelled, "cancelled");
}

} // namespace packtrace
