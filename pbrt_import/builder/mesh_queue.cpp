#include "pbrt_import/builder/mesh_queue.h"

#include <tbb/task_arena.h>

#include "pbrt_import/base/memory_budget.h"
#include "pbrt_import/shapes/mesh_cleanup.h"
#include "pbrt_import/text/problem_text.h"

namespace packtrace {

MeshResult run_job(MeshJob& job, double tessellation_tolerance, const CheckCancelledFn& check_cancelled,
                   MemoryReservation* memory) try {
  MeshResult made;
  const ReportFn report = [&](Severity severity, uint32_t, std::string message) {
    made.reports.emplace_back(severity, std::move(message));
  };
  made.problem = problem_of([&] {
    ShapeContext context{tessellation_tolerance, report, check_cancelled, 0, memory};
    if (job.make) {
      made.mesh = job.make(context);
    } else {
      made.mesh = std::move(job.given);
      context.dropped_triangles = clean_up_mesh(made.mesh, report);
    }
    made.dropped_triangles = context.dropped_triangles;
    if (made.mesh.triangles.empty()) throw Error(ErrorKind::kInput, "no triangle is left");
  });
  if (memory) memory->resize(bytes_of(made.mesh), "the shape");
  return made;
} catch (const MemoryError& error) {
  MeshResult made;
  made.memory_problem = error.what();
  return made;
}

MeshQueue::~MeshQueue() {
  try {
    tasks_.cancel();
    tasks_.wait();
  } catch (...) {
    // Errors of cancelled tasks are dropped, because another error is already propagating.
  }
}

void MeshQueue::add(Entry entry) {
  constexpr uint64_t kMaxPendingBytes = 64u << 20; // beyond this, the reading thread waits and helps
  entries_.push_back(std::move(entry));
  Entry& queued = entries_.back();
  pending_bytes_ += queued.job.bytes_at_most;
  const auto work = [this, &queued] {
    queued.made = run_job(queued.job, tolerance_, check_cancelled_, &queued.memory);
    queued.job.make = nullptr;
  };
  if (tbb::this_task_arena::max_concurrency() == 1) return work();
  tasks_.run(work);
  if (pending_bytes_ < kMaxPendingBytes) return;
  tasks_.wait();
  pending_bytes_ = 0;
}

void MeshQueue::finish(const std::function<void(Entry&)>& take) {
  tasks_.wait();
  for (Entry& entry : entries_) take(entry);
  entries_.clear();
}

} // namespace packtrace
