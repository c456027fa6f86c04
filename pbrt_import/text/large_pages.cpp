#include "pbrt_import/text/large_pages.h"

#include <cstdlib>

#include <sys/mman.h>

namespace packtrace {

void prefer_large_pages(void* memory, size_t bytes) {
  constexpr uintptr_t kLargePage = 2u << 20;
  constexpr size_t kWorthIt = 4 * kLargePage;
  if (!memory || bytes < kWorthIt) return;
  const uintptr_t begin = (reinterpret_cast<uintptr_t>(memory) + kLargePage - 1) & ~(kLargePage - 1);
  const uintptr_t end = (reinterpret_cast<uintptr_t>(memory) + bytes) & ~(kLargePage - 1);
  // A kernel without large pages refuses, and nothing is lost.
  (void)::madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
}

/// Takes a large block and gives it back untouched: malloc keeps it and cuts small ones out of it. glibc maps a large
/// block apart at first, but having seen one freed takes those up to 32 MiB from its heap. Other kinds of malloc may
/// return both blocks to the system: then nothing is lost, either.
/// Source: the GNU C library's manual, mallopt(3), M_MMAP_THRESHOLD.
void LargeHeapPages::prepare() {
  constexpr size_t kBlock = 24u << 20;
  // Others' blocks come out of it, too. Not in small steps: malloc's notes behind each block spoil a large page.
  constexpr uint64_t kStep = 16u << 20;
  for (int time = 0; time < 2; ++time) {
    void* const block = std::malloc(kBlock);
    prefer_large_pages(block, kBlock);
    std::free(block);
  }
  next_ = allocated_ + kStep;
}

} // namespace packtrace
