#pragma once

#include <tbb/enumerable_thread_specific.h>
#include <tbb/task_scheduler_observer.h>

namespace packtrace {

/// Requests large pages for what malloc returns to the threads that work while this object exists. Programs with many
/// arrays of megabytes spend a tenth of their time on small pages: on faults, and on translating addresses.
class LargeHeaps : private tbb::task_scheduler_observer {
public:
  /// To be called by the thread that starts the work.
  LargeHeaps();
  ~LargeHeaps() override { observe(false); }
  LargeHeaps(const LargeHeaps&) = delete;
  LargeHeaps& operator=(const LargeHeaps&) = delete;

private:
  void on_scheduler_entry(bool is_worker) override;

  tbb::enumerable_thread_specific<bool> prepared_{false}; // per worker, as workers enter more than once
};

} // namespace packtrace
