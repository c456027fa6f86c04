#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "runtime/gpu/device/staged_buffer.h"
#include "runtime/gpu/records/gpu_records.h"

namespace packtrace::gpu {

/// The hits of a picture's camera rays, and G-buffer planes made from them, on a device and mapped.
class DeviceView {
public:
  /// Throws as Buffer does.
  DeviceView(const std::shared_ptr<Device>& device, size_t pixels)
      : device_(device), pixels_(pixels), hits_(device, pixels * sizeof(packed::KernelHit), "hits") {}

  const std::shared_ptr<Device>& device() const { return device_; }
  size_t pixels() const { return pixels_; }
  const StagedBuffer& hits_buffer() const { return hits_; }
  /// kPlaneWords words per pixel, plane by plane. Allocated at the first call, which throws as Buffer does.
  const StagedBuffer& planes() {
    if (planes_.bytes() == 0) planes_ = StagedBuffer(device_, pixels_ * kPlaneWords * sizeof(uint32_t), "surfaces");
    return planes_;
  }
  const StagedBuffer& planes() const { return planes_; }
  /// Whether the planes are those of the hits.
  bool has_surfaces() const { return has_surfaces_; }
  /// Whether surfaces moved in the picture since the previous one. Otherwise the planes of motion and previous depths
  /// are undefined.
  bool has_motion() const { return has_motion_; }
  void set_surfaces(bool made, bool moved) { has_surfaces_ = made, has_motion_ = moved; }
  /// Returns a plane that was read back.
  template <typename Value>
  std::span<const Value> plane(uint32_t number) const {
    return {reinterpret_cast<const Value*>(planes_.host().as<uint32_t>() + number * pixels_), pixels_};
  }
  /// One per pixel, rows top to bottom.
  std::span<const packed::KernelHit> hits() const { return {hits_.host().as<packed::KernelHit>(), pixels_}; }

private:
  std::shared_ptr<Device> device_;
  size_t pixels_;
  StagedBuffer hits_, planes_;
  bool has_surfaces_ = false, has_motion_ = false;
};

} // namespace packtrace::gpu
