#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "runtime/gpu/device/buffer.h"
#include "runtime/gpu/device/commands.h"

namespace packtrace::gpu {

/// Copies bytes on several threads: one does not reach the speed of the memory.
void copy_in_parts(std::byte* to, const std::byte* from, size_t bytes);

/// A buffer on the device with a mapped twin, through which its bytes go.
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
  /// Does the same, but copies only the records that differ from those written before. Returns the number of bytes that
  /// are copied.
  uint64_t write_changes(Commands& commands, std::span<const std::byte> bytes, size_t record_bytes);

private:
  Buffer host_, device_;
  size_t written_ = 0; ///< bytes that both hold
};

} // namespace packtrace::gpu
