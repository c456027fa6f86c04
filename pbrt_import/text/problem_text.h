#pragma once

#include <new>
#include <stdexcept>
#include <string>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/memory_budget.h"
#include "pbrt_import/text/reporter.h"

namespace packtrace {

/// Runs `work` on one file or shape and returns the message of the error that it throws, or an empty string.
/// Error(kCancelled) and MemoryError are rethrown; other allocation failures become MemoryError.
template <class Work>
std::string problem_of(Work work) {
  try {
    work();
    return {};
  } catch (const MemoryError&) {
    throw;
  } catch (const Error& error) {
    if (error.kind() == ErrorKind::kCancelled) throw;
    return error.what();
  } catch (const std::bad_alloc&) {
    throw MemoryError(kNoMemory);
  } catch (const std::length_error&) {
    throw MemoryError(kNoMemory);
  }
}

/// Runs work and adds a file, line and column to a MemoryError that it throws.
/// @param place returns the position of the directive or parameter that needed the memory; called only on failure
template <class Place, class Work>
auto with_place(const Reporter& reporter, Place place, Work work) {
  try {
    return work();
  } catch (const MemoryError& error) {
    throw MemoryError(reporter.locate(place()), error.what());
  }
}

} // namespace packtrace
