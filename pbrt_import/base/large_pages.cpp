#include "pbrt_import/base/large_pages.h"

#include <cstdlib>

#include <sys/mman.h>

namespace packtrace {
namespace {

constexpr size_t kHeapBlock = 24u << 20; // larger ones might be mapped separately
// Sanitizers replace malloc: theirs serves no other allocation from a freed block, and writes to each new one.
#ifdef PACKTRACE_SANITIZED
constexpr bool kMallocKeepsBlocks = false;
#else
constexpr bool kMallocKeepsBlocks = true;
#endif

} // namespace

void prefer_large_pages(void* memory, size_t bytes) {
  constexpr uintptr_t kLargePage = 2u << 20;
  constexpr size_t kMinLargePageBytes = 4 * kLargePage;
  if (!memory || bytes < kMinLargePageBytes) return;
  const uintptr_t begin = (reinterpret_cast<uintptr_t>(memory) + kLargePage - 1) & ~(kLargePage - 1);
  const uintptr_t end = (reinterpret_cast<uintptr_t>(memory) + bytes) & ~(kLargePage - 1);
  // Kernels without large pages return an error, which is harmless.
  (void)::madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
}

/// Allocates large blocks and frees them untouched: malloc keeps them and serves other allocations from them.
void prefer_large_heap_pages(size_t bytes) {
  if (!kMallocKeepsBlocks) return;
  std::vector<void*> blocks((bytes + kHeapBlock - 1) / kHeapBlock);
  for (void*& block : blocks) {
    block = std::malloc(kHeapBlock);
    prefer_large_pages(block, kHeapBlock);
  }
  for (void* const block : blocks) std::free(block);
}

/// glibc first maps a large block separately, but after such a block is freed it serves sizes up to 32 MiB from its
/// heap; hence two rounds. Other malloc implementations may return both blocks to the system, which is harmless.
/// Source: the GNU C library's manual, mallopt(3), M_MMAP_THRESHOLD.
void LargeHeapPages::prepare() {
  // Less than a block, because other allocations use the block as well. Small steps would not work: malloc's
  // bookkeeping behind each block touches a large page.
  constexpr uint64_t kStep = 16u << 20;
  for (int time = 0; time < 2; ++time) prefer_large_heap_pages(kHeapBlock);
  next_ = allocated_ + kStep;
}

} // namespace packtrace
