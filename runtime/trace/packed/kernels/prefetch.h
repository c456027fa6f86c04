#pragma once

#include <cstddef>
#include <cstdint>

namespace packtrace::packed {
namespace {

/// Prefetches the cache lines of `bytes` bytes from `offset` on; they may lie behind the end of the array.
/// @tparam kToWrite whether they will be written
template <bool kToWrite = false>
[[gnu::always_inline]] inline void prefetch(const void* array, size_t offset, size_t bytes) {
  const uintptr_t begin = reinterpret_cast<uintptr_t>(array) + offset;
  for (size_t line = 0; line < bytes; line += 64)
    __builtin_prefetch(reinterpret_cast<const void*>(begin + line), kToWrite ? 1 : 0);
}

} // namespace
} // namespace packtrace::packed
