#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "runtime/gpu/device/buffer.h"
#include "runtime/gpu/device/commands.h"

namespace packtrace::gpu {

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
  void write(Commands& commands, std::span<const std::byte> bytes) const;
  /// Writes only records that differ from those of the last write; one at least that was as long came before. Returns
  /// the number of bytes that are copied.
  uint64_t write_changes(Commands& commands, std::span<const std::byte> bytes, size_t record_bytes) const;

private:
  Buffer host_, device_;
};

} // namespace packtrace::gpu
