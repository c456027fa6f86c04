#include "runtime/trace/embree/embree_device.h"

#include <algorithm>
#include <utility>

namespace packtrace {

EmbreeDevice::EmbreeDevice(const std::optional<MemoryBudget>& budget, const char* options)
    : budget_(budget), device_(rtcNewDevice(options)) {
  if (!device_ && rtcGetDeviceError(nullptr) == RTC_ERROR_OUT_OF_MEMORY) throw MemoryError(kNoMemory);
  if (!device_) throw Error(ErrorKind::kUnsupported, "Embree cannot create a device on this machine");
  if (budget_) reserved_ = MemoryReservation(*budget_);
  reserve();
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
  if (refused_.exchange(false)) {
    code_ = RTC_ERROR_NONE;
    throw MemoryError("Embree's trees need more than the " + memory_text(static_cast<uint64_t>(max_bytes_)) +
                      " of memory left for them; --max-memory raises it");
  }
  if (code_ == RTC_ERROR_NONE) {
    reserve();
    return;
  }
  const RTCError code = std::exchange(code_, RTC_ERROR_NONE);
  if (code == RTC_ERROR_CANCELLED) throw Error(ErrorKind::kCancelled, "cancelled");
  const ErrorKind kind = code == RTC_ERROR_OUT_OF_MEMORY ? ErrorKind::kLimitExceeded : ErrorKind::kUnsupported;
  throw Error(kind, "Embree: " + (text_.empty() ? "error " + std::to_string(code) : text_));
}

void EmbreeDevice::reserve() {
  if (!budget_) return;
  reserved_.resize(bytes(), "Embree");
  max_bytes_ = bytes_ + static_cast<int64_t>(std::min<uint64_t>(budget_->left(), uint64_t{1} << 62));
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
  if (bytes > 0 && now > device.max_bytes_) {
    device.bytes_.fetch_sub(bytes, std::memory_order_relaxed);
    device.refused_ = true;
    return false; // Embree fails with RTC_ERROR_OUT_OF_MEMORY
  }
  int64_t peak = device.peak_.load(std::memory_order_relaxed);
  while (peak < now && !device.peak_.compare_exchange_weak(peak, now, std::memory_order_relaxed)) {
  }
  return true;
}

} // namespace packtrace
