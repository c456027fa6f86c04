#include "runtime/trace/packed/batch_cache.h"

#include <atomic>
#include <cstddef>
#include <vector>

namespace packtrace {
namespace {

constexpr uint32_t kEntryBits = 10; // 320 KiB: a third of a common second-level cache

std::atomic<uint64_t> next_owner{1}, thread_count{0};

struct ThreadCache {
  std::vector<packed::DecodedBatch> entries{size_t{1} << kEntryBits};
  packed::BatchCache view{entries.data(), 32 - kEntryBits};
  uint64_t owner = 0;

  ThreadCache() { ++thread_count; }
  ~ThreadCache() { --thread_count; }
};

} // namespace

BatchCacheOwner::BatchCacheOwner() : number_(next_owner++) {}

packed::BatchCache& BatchCacheOwner::of_this_thread() const {
  thread_local ThreadCache cache;
  if (cache.owner != number_) {
    for (packed::DecodedBatch& entry : cache.entries) entry.tag = 0;
    cache.owner = number_;
  }
  return cache.view;
}

uint64_t BatchCacheOwner::bytes_of_all_threads() {
  return thread_count * (uint64_t{sizeof(packed::DecodedBatch)} << kEntryBits);
}

} // namespace packtrace
