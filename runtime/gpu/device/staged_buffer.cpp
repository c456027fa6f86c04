#include "runtime/gpu/device/staged_buffer.h"

#include <algorithm>
#include <cstring>

namespace packtrace::gpu {

void StagedBuffer::write(Commands& commands, std::span<const std::byte> bytes) const {
  if (bytes.empty()) return;
  std::memcpy(host_.data(), bytes.data(), bytes.size());
  commands.copy(host_, device_, bytes.size());
}

uint64_t StagedBuffer::write_changes(Commands& commands, std::span<const std::byte> bytes, size_t record_bytes) const {
  constexpr size_t kJoined = 256; // a copy of its own costs more than so many bytes
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
    if (std::memcmp(host_.data() + at, bytes.data() + at, size) == 0) continue;
    if (begin == end || at > end + kJoined) {
      copy_run();
      begin = at;
    }
    end = at + size;
  }
  copy_run();
  return copied;
}

} // namespace packtrace::gpu
