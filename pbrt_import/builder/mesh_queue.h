#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <tbb/task_group.h>

#include "pbrt_import/language/parameters.h"
#include "pbrt_import/base/diagnostics.h"
#include "pbrt_import/builder/shape_builder.h"

namespace packtrace {

/// What became of a MeshJob.
struct MadeMesh {
  Mesh mesh;
  std::string problem; ///< empty: mesh has triangles
  std::vector<std::pair<Severity, std::string>> reports;
  uint64_t dropped_triangles = 0;
  std::string memory_problem; ///< not empty: it needs more memory than there may be
};

/// Throws what check_cancelled throws.
/// @param job its mesh is taken out
/// @param memory becomes that of the mesh; null: nobody counts
MadeMesh run_job(MeshJob& job, double tessellation_tolerance, const CheckCancelledFn& check_cancelled,
                 MemoryReservation* memory = nullptr);

/// Makes meshes on all threads while the scene's text is still being read.
class MeshQueue {
public:
  /// A mesh to be made, and what its maker needs to know again once it is there.
  struct Entry {
    MeshJob job;
    std::string_view kind; ///< ShapeKind::name, for messages
    Place place;
    uint64_t sequence = 0; ///< Reporter's
    uint32_t slot = 0;     ///< in Scene::meshes
    MemoryReservation memory; ///< for the mesh
    MadeMesh made;
  };

  MeshQueue(double tessellation_tolerance, const CheckCancelledFn& check_cancelled)
      : tolerance_(tessellation_tolerance), check_cancelled_(check_cancelled) {}
  ~MeshQueue();
  MeshQueue(const MeshQueue&) = delete;
  MeshQueue& operator=(const MeshQueue&) = delete;

  void add(Entry entry);
  /// Waits for all of them and hands them over in the order they came.
  void finish(const std::function<void(Entry&)>& take);

private:
  double tolerance_;
  const CheckCancelledFn& check_cancelled_;
  std::deque<Entry> entries_; ///< stay where they are
  uint64_t pending_bytes_ = 0;
  tbb::task_group tasks_;
};

} // namespace packtrace
