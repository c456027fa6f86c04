#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "pbrt_import/base/diagnostics.h"
#include "pbrt_import/base/memory_budget.h"

namespace packtrace {

/// Receives problems from which a shape or file reader recovered. `line` counts from 1 in the file being read; 0 if
/// unknown. May be empty, which discards reports.
using ReportFn = std::function<void(Severity severity, uint32_t line, std::string message)>;

/// Called regularly by shapes that may take long; throws to stop them, usually Error(kCancelled). May be empty.
using CheckCancelledFn = std::function<void()>;

/// Grows a shape's reservation before an allocation; no effect on null. Throws MemoryError.
inline void reserve_for_shape(MemoryReservation* memory, uint64_t bytes) {
  if (memory) memory->cover(bytes, "the shape");
}

} // namespace packtrace
