#include "pbrt_import/number_array.h"

#include <sys/mman.h>

namespace packtrace {

void prefer_large_pages(void* memory, size_t bytes) {
  constexpr uintptr_t kLargePage = 2u << 20;
  constexpr size_t kWorthIt = 4 * kLargePage;
  if (bytes < kWorthIt) return;
  const uintptr_t begin = (reinterpret_cast<uintptr_t>(memory) + kLargePage - 1) & ~(kLargePage - 1);
  const uintptr_t end = (reinterpret_cast<uintptr_t>(memory) + bytes) & ~(kLargePage - 1);
  // A kernel without large pages refuses, and nothing is lost.
  (void)::madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
}

} // namespace packtrace
