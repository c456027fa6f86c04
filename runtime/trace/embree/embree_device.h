#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include <embree3/rtcore.h>

#include "pbrt_import/base/memory_budget.h"

namespace packtrace {

struct ReleaseRtc {
  void operator()(RTCSceneTy* scene) const { rtcReleaseScene(scene); }
  void operator()(RTCGeometryTy* geometry) const { rtcReleaseGeometry(geometry); }
  void operator()(RTCDeviceTy* device) const { rtcReleaseDevice(device); }
};
template <typename T>
using RtcPtr = std::unique_ptr<T, ReleaseRtc>;

/// An Embree device that counts its memory, keeps it within a budget, and turns error codes into Error.
class EmbreeDevice {
public:
  /// Allocations beyond the budget fail, which check() reports.
  /// @param options of rtcNewDevice(), or null
  /// Throws Error(kUnsupported) if the device cannot be made or was built without ray masks, filter functions,
  /// ray streams or triangles.
  explicit EmbreeDevice(const std::optional<MemoryBudget>& budget = std::nullopt, const char* options = nullptr);
  EmbreeDevice(const EmbreeDevice&) = delete;
  EmbreeDevice& operator=(const EmbreeDevice&) = delete;

  RTCDevice get() const { return device_.get(); }

  /// Reserves the memory that the device holds now from the budget. Throws errors that were reported since the last
  /// call: MemoryError for allocations beyond the budget, Error(kLimitExceeded) where the system had no memory,
  /// Error(kCancelled) for a build that was stopped, else Error(kUnsupported).
  void check();

  /// Bytes currently allocated.
  uint64_t bytes() const { return static_cast<uint64_t>(bytes_.load(std::memory_order_relaxed)); }
  /// Maximum of bytes() since start_peak().
  uint64_t peak_bytes() const { return static_cast<uint64_t>(peak_.load(std::memory_order_relaxed)); }
  void start_peak() { peak_.store(bytes_.load(std::memory_order_relaxed), std::memory_order_relaxed); }

private:
  void reserve();
  static void on_error(void* self, RTCError code, const char* text);
  static bool on_memory(void* self, ssize_t bytes, bool post);

  std::atomic<int64_t> bytes_{0}, peak_{0};
  std::atomic<int64_t> max_bytes_{INT64_MAX}; ///< what the budget allowed at the last check()
  std::atomic<bool> refused_{false};
  std::optional<MemoryBudget> budget_;
  MemoryReservation reserved_;
  std::mutex mutex_;
  RTCError code_ = RTC_ERROR_NONE; ///< first error since check()
  std::string text_;
  RtcPtr<RTCDeviceTy> device_; ///< declared last: its callbacks use the members above
};

} // namespace packtrace
