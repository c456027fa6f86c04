#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "runtime/gpu/device/device.h"

namespace packtrace::gpu {

enum class BufferPlace : uint8_t {
  kDevice,  ///< fast for kernels
  kHost,    ///< mapped; kernels can read and write it
  kUnbound, ///< on the device, for builds of structures: no kernel binds it, so it may have any size
};

/// A storage buffer. Bytes are not initialised.
class Buffer {
public:
  Buffer() = default;
  /// @param what name of the buffer in messages
  /// Throws Error(kLimitExceeded) with the needed and the available bytes, and Error(kUnsupported) for more bytes than
  /// a kernel can address in one buffer.
  Buffer(std::shared_ptr<Device> device, uint64_t bytes, BufferPlace place, const char* what);
  ~Buffer();
  Buffer(Buffer&& other) noexcept { swap(other); }
  Buffer& operator=(Buffer&& other) noexcept {
    swap(other);
    return *this;
  }

  VkBuffer handle() const { return buffer_; }
  uint64_t bytes() const { return bytes_; }
  /// Address for kernels and builds. Only on devices with GpuStructures::kDriver.
  uint64_t address() const;
  /// kHost only.
  std::byte* data() const { return mapped_; }
  template <typename T>
  T* as() const {
    return reinterpret_cast<T*>(mapped_);
  }

private:
  void swap(Buffer& other) noexcept;
  void allocate(BufferPlace place, const char* what);

  std::shared_ptr<Device> device_;
  VkBuffer buffer_ = VK_NULL_HANDLE;
  VkDeviceMemory memory_ = VK_NULL_HANDLE;
  uint64_t bytes_ = 0, allocated_ = 0;
  std::byte* mapped_ = nullptr;
};

/// Creates a buffer on the device that holds the given bytes, followed by `extra_bytes` zeros.
Buffer upload(const std::shared_ptr<Device>& device, std::span<const std::byte> bytes, const char* what,
              uint64_t extra_bytes = 0);
/// Overwrites bytes of a buffer on the device.
void update(const std::shared_ptr<Device>& device, const Buffer& buffer, uint64_t offset,
            std::span<const std::byte> bytes);
/// Reads bytes of a buffer on the device.
void download(const std::shared_ptr<Device>& device, const Buffer& buffer, uint64_t offset, std::span<std::byte> bytes);

} // namespace packtrace::gpu
