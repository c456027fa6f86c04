#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/gpu/device/vulkan_api.h"

namespace packtrace::gpu {

class Buffer;
class Kernel;

/// Work that is submitted at once. Dispatches see the writes of all earlier work, copies those of earlier dispatches.
/// Consecutive copies must not overlap.
class Commands {
public:
  /// Kernels and buffers must outlive the run.
  /// @param push push constants, at most kMaxPushBytes
  void dispatch(const Kernel& kernel, std::span<const std::byte> push, uint32_t groups_x, uint32_t groups_y);
  void copy(const Buffer& from, const Buffer& to, uint64_t bytes) { copy(from, to, 0, bytes); }
  /// @param offset of the bytes in both buffers
  void copy(const Buffer& from, const Buffer& to, uint64_t offset, uint64_t bytes) {
    copy(from, to, offset, offset, bytes);
  }
  void copy(const Buffer& from, const Buffer& to, uint64_t from_offset, uint64_t to_offset, uint64_t bytes);
  /// Sets words of a buffer.
  void fill(const Buffer& buffer, uint64_t first_word, uint64_t words, uint32_t value);

  static constexpr size_t kMaxPushBytes = 128; ///< that every device has
  static constexpr uint32_t kMaxDispatches = 32;

private:
  friend class Device;

  enum class Kind : uint8_t { kDispatch, kCopy, kFill };
  struct Step {
    Kind kind = Kind::kDispatch;
    const Kernel* kernel = nullptr;
    std::array<std::byte, kMaxPushBytes> push{};
    uint32_t push_bytes = 0, groups_x = 0, groups_y = 0;
    VkBuffer from = VK_NULL_HANDLE, to = VK_NULL_HANDLE;
    uint64_t from_offset = 0, offset = 0, bytes = 0; ///< offset: in `to`
    uint32_t value = 0;
  };
  std::vector<Step> steps_;
};

} // namespace packtrace::gpu
