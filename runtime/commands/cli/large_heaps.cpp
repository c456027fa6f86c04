#include "runtime/commands/cli/large_heaps.h"

#include <atomic>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/task_scheduler_observer.h>

#include "pbrt_import/base/large_pages.h"

namespace packtrace {
namespace {

constexpr size_t kOwnBytes = 240u << 20;   // enough for scenes of two million triangles
constexpr size_t kWorkerBytes = 48u << 20; // glibc's heaps of other threads hold up to 64 MiB each
constexpr uint32_t kMaxWorkers = 15;       // bounds the memory: a worker's heap may take three pages of 2 MiB more

class WorkerObserver : public tbb::task_scheduler_observer {
public:
  WorkerObserver() {
    prefer_large_heap_pages(kOwnBytes);
    observe(true);
  }

  void on_scheduler_entry(bool is_worker) override {
    if (bool& prepared = prepared_.local(); is_worker && !prepared) {
      prepared = true;
      if (workers_++ < kMaxWorkers) prefer_large_heap_pages(kWorkerBytes);
    }
  }

private:
  tbb::enumerable_thread_specific<bool> prepared_{false}; // per worker, as workers enter more than once
  std::atomic<uint32_t> workers_ = 0;
};

} // namespace

void prefer_large_heaps() {
  static const WorkerObserver* const observer = new WorkerObserver; // never destroyed, as workers outlive main()
  static_cast<void>(observer);
}

} // namespace packtrace
