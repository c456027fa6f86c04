#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "pbrt_import/base/diagnostics.h"
#include "pbrt_import/base/memory_budget.h"

namespace packtrace {

/// Takes problems that a shape or file reader survived. line counts from 1 in the file being read; 0: no line known.
/// May be empty: then nobody listens.
using ReportFn = std::function<void(Severity severity, uint32_t line, std::string message)>;

/// Called now and then by shapes that may take long; throws to stop them, usually Error(kCancelled). May be empty.
using CheckCancelledFn = std::function<void()>;

/// Makes room in a shape's reservation ahead of an allocation, where somebody counts. Throws MemoryError.
inline void reserve_for_shape(MemoryReservation* memory, uint64_t bytes) {
  if (memory) memory->cover(bytes, "the shape");
}

} // namespace packtrace
