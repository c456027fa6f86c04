#include "runtime/trace/packed/thread_memory.h"

#include <atomic>
#include <cstddef>
#include <vector>

namespace packtrace {
namespace {

constexpr uint32_t kEntryBits = 10; // 320 KiB: a third of a common second-level cache
constexpr uint64_t kBatchBytes = uint64_t{sizeof(packed::DecodedBatch)} << kEntryBits;

struct alignas(packed::kStreamAlignment) StreamBlock {
  std::byte bytes[packed::kStreamAlignment];
};

std::atomic<uint64_t> next_owner{1}, all_bytes{0};

struct Memory {
  std::vector<packed::DecodedBatch> batches{size_t{1} << kEntryBits};
  std::vector<StreamBlock> stream;
  packed::ThreadMemory view{{batches.data(), 32 - kEntryBits}, nullptr};
  uint64_t owner = 0;

  Memory() { all_bytes += kBatchBytes; }
  ~Memory() { all_bytes -= kBatchBytes + stream.size() * sizeof(StreamBlock); }

  void make_room(uint32_t top_depth) {
    const size_t blocks = packed::stream_bytes(top_depth) / sizeof(StreamBlock) + 1;
    if (blocks <= stream.size()) return;
    all_bytes += (blocks - stream.size()) * sizeof(StreamBlock);
    stream.resize(blocks);
  }
};

} // namespace

ThreadMemoryOwner::ThreadMemoryOwner() : number_(next_owner++) {}

packed::ThreadMemory& ThreadMemoryOwner::of_this_thread(uint32_t top_depth) const {
  thread_local Memory memory;
  if (memory.owner != number_) {
    for (packed::DecodedBatch& entry : memory.batches) entry.tag = 0;
    if (top_depth > 0) memory.make_room(top_depth);
    memory.view.stream = top_depth > 0 ? memory.stream.data() : nullptr;
    memory.owner = number_;
  }
  return memory.view;
}

uint64_t ThreadMemoryOwner::bytes_of_all_threads() { return all_bytes; }

} // namespace packtrace
