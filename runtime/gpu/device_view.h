#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "runtime/gpu/device/staged_buffer.h"
#include "runtime/gpu/records/gpu_records.h"

namespace packtrace::gpu {

/// What the camera rays of a picture hit, on a device and mapped.
class DeviceView {
public:
  /// Throws as Buffer does.
  DeviceView(const std::shared_ptr<Device>& device, size_t pixels)
      : device_(device), pixels_(pixels), hits_(device, pixels * sizeof(packed::KernelHit), "hits") {}

  const std::shared_ptr<Device>& device() const { return device_; }
  size_t pixels() const { return pixels_; }
  const StagedBuffer& hits_buffer() const { return hits_; }
  /// One per pixel, rows top to bottom.
  std::span<const packed::KernelHit> hits() const { return {hits_.host().as<packed::KernelHit>(), pixels_}; }

private:
  std::shared_ptr<Device> device_;
  size_t pixels_;
  StagedBuffer hits_;
};

} // namespace packtrace::gpu
