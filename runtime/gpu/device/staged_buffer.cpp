#include "runtime/gpu/device/staged_buffer.h"

#include <algorithm>
#include <cstring>

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace packtrace::gpu {

void copy_in_parts(std::byte* to, const std::byte* from, size_t bytes) {
  constexpr size_t kPart = 1u << 20;
  // Callers may hold locks, so the thread must not take up other work while it waits.
  tbb::this_task_arena::isolate([&] {
    tbb::parallel_for(size_t{0}, (bytes + kPart - 1) / kPart, [&](size_t i) {
      std::memcpy(to + i * kPart, from + i * kPart, std::min(kPart, bytes - i * kPart));
    });
  });
}

void StagedBuffer::write(Commands& commands, std::span<const std::byte> bytes) {
  if (bytes.empty()) return;
  copy_in_parts(host_.data(), bytes.data(), bytes.size());
  commands.copy(host_, device_, bytes.size());
  written_ = std::max(written_, bytes.size());
}

uint64_t StagedBuffer::write_changes(Commands& commands, std::span<const std::byte> bytes, size_t record_bytes) {
  constexpr size_t kJoined = 256; // a separate copy costs more than this many bytes
  uint64_t copied = 0;
  size_t begin = 0, end = 0; // bytes to copy
  const auto copy_run = [&] {
    if (begin == end) return;
    std::memcpy(host_.data() + begin, bytes.data() + begin, end - begin);
    commands.copy(host_, device_, begin, end - begin);
    copied += end - begin;
  };
  for (size_t at = 0; at < bytes.size(); at += record_bytes) {
    const size_t size = std::min(record_bytes, bytes.size() - at);
    if (at + size <= written_ && std::memcmp(host_.data() + at, bytes.data() + at, size) == 0) continue;
    if (begin == end || at > end + kJoined) {
      copy_run();
      begin = at;
    }
    end = at + size;
  }
  copy_run();
  written_ = std::max(written_, bytes.size());
  return copied;
}

} // namespace packtrace::gpu
