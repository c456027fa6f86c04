#include "runtime/trace/embree_device.h"

#include <utility>

namespace packtrace {

EmbreeDevice::EmbreeDevice() : device_(rtcNewDevice(nullptr)) {
  if (!device_) throw Error(ErrorKind::kUnsupported, "Embree cannot create a device on this machine");
  rtcSetDeviceErrorFunction(get(), on_error, this);
  rtcSetDeviceMemoryMonitorFunction(get(), on_memory, this);
  for (const RTCDeviceProperty property :
       {RTC_DEVICE_PROPERTY_RAY_MASK_SUPPORTED, RTC_DEVICE_PROPERTY_FILTER_FUNCTION_SUPPORTED,
        RTC_DEVICE_PROPERTY_RAY_STREAM_SUPPORTED, RTC_DEVICE_PROPERTY_TRIANGLE_GEOMETRY_SUPPORTED})
    if (rtcGetDeviceProperty(get(), property) == 0)
      throw Error(ErrorKind::kUnsupported, "this Embree was built without ray masks, filters, streams or triangles");
}

void EmbreeDevice::check() {
  const std::lock_guard lock(mutex_);
  if (code_ == RTC_ERROR_NONE) return;
  const RTCError code = std::exchange(code_, RTC_ERROR_NONE);
  if (code == RTC_ERROR_CANCELLED) throw Error(ErrorKind::kCancelled, "cancelled");
  const ErrorKind kind = code == RTC_ERROR_OUT_OF_MEMORY ? ErrorKind::kLimitExceeded : ErrorKind::kUnsupported;
  throw Error(kind, "Embree: " + (text_.empty() ? "error " + std::to_string(code) : text_));
}

void EmbreeDevice::on_error(void* self, RTCError code, const char* text) {
  auto& device = *static_cast<EmbreeDevice*>(self);
  const std::lock_guard lock(device.mutex_);
  if (device.code_ != RTC_ERROR_NONE) return;
  device.code_ = code;
  device.text_ = text ? text : "";
}

bool EmbreeDevice::on_memory(void* self, ssize_t bytes, bool) {
  auto& device = *static_cast<EmbreeDevice*>(self);
  const int64_t now = device.bytes_.fetch_add(bytes, std::memory_order_relaxed) + bytes;
  int64_t peak = device.peak_.load(std::memory_order_relaxed);
  while (peak < now && !device.peak_.compare_exchange_weak(peak, now, std::memory_order_relaxed)) {
  }
  return true;
}

} // namespace packtrace
