#include "runtime/gpu/device/commands.h"

#include <algorithm>
#include <cassert>

#include "runtime/gpu/device/buffer.h"

namespace packtrace::gpu {

void Commands::dispatch(const Kernel& kernel, std::span<const std::byte> push, uint32_t groups_x, uint32_t groups_y) {
  assert(push.size() <= kMaxPushBytes);
  Step step;
  step.kernel = &kernel;
  std::ranges::copy(push, step.push.begin());
  step.push_bytes = static_cast<uint32_t>(push.size()), step.groups_x = groups_x, step.groups_y = groups_y;
  steps_.push_back(step);
}

void Commands::copy(const Buffer& from, const Buffer& to, uint64_t from_offset, uint64_t to_offset, uint64_t bytes) {
  if (bytes == 0) return;
  Step step;
  step.kind = Kind::kCopy, step.from = from.handle(), step.to = to.handle();
  step.from_offset = from_offset, step.offset = to_offset, step.bytes = bytes;
  steps_.push_back(step);
}

void Commands::fill(const Buffer& buffer, uint64_t first_word, uint64_t words, uint32_t value) {
  Step step;
  step.kind = Kind::kFill, step.to = buffer.handle(), step.value = value;
  step.offset = first_word * sizeof(uint32_t), step.bytes = words * sizeof(uint32_t);
  steps_.push_back(step);
}

} // namespace packtrace::gpu
