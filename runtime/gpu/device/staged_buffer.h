#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "runtime/gpu/device/buffer.h"
#include "runtime/gpu/device/commands.h"

namespace packtrace::gpu {

/// Copies bytes on several threads, because one thread does not reach the memory bandwidth.
void copy_in_parts(std::byte* to, const std::byte* from, size_t bytes);

/// A buffer on the device with a mapped staging buffer, through which it is written.
class StagedBuffer {
public:
  StagedBuffer() = default;
  /// Throws as Buffer does.
  StagedBuffer(const std::shared_ptr<Device>& device, uint64_t bytes, const char* what)
      : host_(device, bytes, BufferPlace::kHost, what), device_(device, bytes, BufferPlace::kDevice, what) {}

  const Buffer& device() const { return device_; }
  const Buffer& host() const { return host_; }
  uint64_t bytes() const { return device_.bytes(); }

  /// Writes the first bytes of the buffer.
  void write(Commands& commands, std::span<const std::byte> bytes);
  /// Like write(), but copies only records that differ from the previous ones. Returns the number of copied bytes.
  uint64_t write_changes(Commands& commands, std::span<const std::byte> bytes, size_t record_bytes);

private:
  Buffer host_, device_;
  size_t written_ = 0; ///< bytes that both hold
};

} // namespace packtrace::gpu
