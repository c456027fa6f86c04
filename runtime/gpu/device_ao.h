#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <utility>

#include "runtime/gpu/device/buffer.h"

namespace packtrace::gpu {

/// Ambient occlusion of a picture that stays on a device: AO of all pixels, then their mean hit distances.
class DeviceAo {
public:
  /// Throws as Buffer does.
  DeviceAo(std::shared_ptr<Device> device, size_t pixels)
      : device_(device), pixels_(pixels),
        values_(std::move(device), 2 * sizeof(float) * pixels, BufferPlace::kDevice, "ambient occlusion") {}

  const std::shared_ptr<Device>& device() const { return device_; }
  size_t pixels() const { return pixels_; }
  const Buffer& values() const { return values_; }

  /// One entry per pixel.
  void read(std::span<float> ao, std::span<float> hit_distance) const {
    download(device_, values_, 0, std::as_writable_bytes(ao));
    download(device_, values_, sizeof(float) * pixels_, std::as_writable_bytes(hit_distance));
  }

private:
  std::shared_ptr<Device> device_;
  size_t pixels_;
  Buffer values_;
};

} // namespace packtrace::gpu
