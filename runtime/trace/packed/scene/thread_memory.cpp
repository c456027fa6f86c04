#include "runtime/trace/packed/scene/thread_memory.h"

#include <atomic>
#include <cstddef>
#include <vector>

namespace packtrace {
namespace {

constexpr uint32_t kEntryBits = 10; // 320 KiB: a third of a common level-2 cache
constexpr uint64_t kBatchBytes = uint64_t{sizeof(packed::DecodedBatch)} << kEntryBits;

/// Bytes that a PlacementStream needs.
/// @param top_depth levels of nodes in the tree over placements
constexpr size_t stream_bytes(uint32_t top_depth) {
  using namespace packed;
  return kStreamGroups * (kStreamGroupBytes + (1 + size_t{top_depth} * baked::kNodeWidth) * kStreamPartBytes);
}

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
    const size_t blocks = stream_bytes(top_depth) / sizeof(StreamBlock) + 1, before = stream.size();
    if (blocks <= before) return;
    stream.resize(blocks);
    all_bytes += (blocks - before) * sizeof(StreamBlock);
  }
};

} // namespace

ThreadMemoryOwner::ThreadMemoryOwner() : number_(next_owner++) {}

packed::ThreadMemory& ThreadMemoryOwner::of_this_thread(uint32_t top_depth) const {
  thread_local Memory memory;
  if (memory.owner != number_) {
    for (packed::DecodedBatch& entry : memory.batches) entry.tag = 0;
    memory.owner = number_;
  }
  if (top_depth > 0) memory.make_room(top_depth);
  memory.view.stream = top_depth > 0 ? memory.stream.data() : nullptr;
  return memory.view;
}

void ThreadMemoryOwner::forget_batches() { number_ = next_owner++; }

uint64_t ThreadMemoryOwner::bytes_of_all_threads() { return all_bytes; }

} // namespace packtrace
