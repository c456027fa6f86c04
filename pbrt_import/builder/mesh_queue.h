#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <tbb/task_group.h>

#include "pbrt_import/base/diagnostics.h"
#include "pbrt_import/builder/shape_builder.h"
#include "pbrt_import/language/parameters.h"

namespace packtrace {

/// Result of a MeshJob.
struct MeshResult {
  Mesh mesh;
  std::string problem; ///< empty if the mesh has triangles
  std::vector<std::pair<Severity, std::string>> reports;
  uint64_t dropped_triangles = 0;
  std::string memory_problem; ///< not empty if the mesh exceeds the memory budget
};

/// Makes the mesh of a job. Memory errors are returned in MeshResult::memory_problem. Throws what check_cancelled
/// throws.
/// @param job its given mesh is moved out
/// @param memory resized to the bytes of the mesh; null: not counted
MeshResult run_job(MeshJob& job, double tessellation_tolerance, const CheckCancelledFn& check_cancelled,
                   MemoryReservation* memory = nullptr);

/// Makes meshes on all threads while the scene text is still being read.
class MeshQueue {
public:
  /// A mesh to be made, with the context that its receiver needs when it is finished.
  struct Entry {
    MeshJob job;
    std::string_view kind; ///< ShapeKind::name, for messages
    Place place;
    uint64_t sequence = 0;    ///< Reporter::sequence() of its directive
    uint32_t slot = 0;        ///< index in Scene::meshes
    MemoryReservation memory; ///< for the mesh
    MeshResult made;
  };

  MeshQueue(double tessellation_tolerance, const CheckCancelledFn& check_cancelled)
      : tolerance_(tessellation_tolerance), check_cancelled_(check_cancelled) {}
  ~MeshQueue();
  MeshQueue(const MeshQueue&) = delete;
  MeshQueue& operator=(const MeshQueue&) = delete;

  void add(Entry entry);
  /// Waits for all meshes and passes them to `take` in the order in which they were added.
  void finish(const std::function<void(Entry&)>& take);

private:
  double tolerance_;
  const CheckCancelledFn& check_cancelled_;
  std::deque<Entry> entries_; ///< a deque, since tasks hold references to its elements
  uint64_t pending_bytes_ = 0;
  tbb::task_group tasks_;
};

} // namespace packtrace
