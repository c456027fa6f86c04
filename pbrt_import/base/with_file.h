#pragma once

#include <filesystem>

#include "pbrt_import/base/memory_budget.h"

namespace packtrace {

/// Runs work and adds the name of a file to a MemoryError that it throws.
template <class Work>
auto with_file(const std::filesystem::path& file, const Work& work) {
  try {
    return work();
  } catch (const MemoryError& error) {
    throw MemoryError(file, error.what());
  }
}

} // namespace packtrace
