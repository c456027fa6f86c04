#include "runtime/commands/cli/large_heaps.h"

#include <atomic>

#include <malloc.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/task_scheduler_observer.h>

#include "pbrt_import/base/large_pages.h"

namespace packtrace {
namespace {

constexpr size_t kOwnBytes = 240u << 20;   // of the calling thread: enough for scenes of two million triangles
constexpr size_t kWorkerBytes = 48u << 20; // of each worker; glibc limits a worker's heap to 64 MiB
constexpr uint32_t kMaxWorkers = 15;       // workers with large pages; each may use 6 MiB more memory than without

/// By default, glibc returns large blocks to the kernel, which then has to clear every page of the next frame's
/// buffers: that took an eighth of the time of moving frames.
void keep_freed_memory() {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 32 << 20); // the largest that glibc accepts
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
#endif
}

/// Requests large pages for the heap of each worker when it first enters TBB's scheduler.
class WorkerObserver : public tbb::task_scheduler_observer {
public:
  WorkerObserver() { observe(true); }

  void on_scheduler_entry(bool is_worker) override {
    if (bool& prepared = prepared_.local(); is_worker && !prepared) {
      prepared = true;
      if (workers_++ < kMaxWorkers) prefer_large_heap_pages(kWorkerBytes);
    }
  }

private:
  tbb::enumerable_thread_specific<bool> prepared_{false}; // per thread, because a worker can enter more than once
  std::atomic<uint32_t> workers_ = 0;
};

} // namespace

void prepare_heaps() {
  // Never destroyed: workers may still enter the scheduler when main() has returned.
  static const WorkerObserver* const observer = [] {
    keep_freed_memory();
    prefer_large_heap_pages(kOwnBytes);
    return new WorkerObserver;
  }();
  static_cast<void>(observer);
}

} // namespace packtrace
