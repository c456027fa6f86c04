#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "runtime/gpu/device/vulkan_api.h"
#include "runtime/gpu/gpu_config.h"

namespace packtrace::gpu {

class Buffer;
class Commands;
class Kernel;

/// Thrown if the device stopped working: its memory cannot be read any more. Not an Error, because state of the program
/// is lost.
class DeviceLost : public std::runtime_error {
public:
  using std::runtime_error::runtime_error;
};

/// Throws unless the result is VK_SUCCESS: DeviceLost, Error(kLimitExceeded) for memory, Error(kUnsupported) for the
/// rest. The message names the call.
void check(VkResult result, const char* call);

/// Properties of a device that kernels depend on.
struct DeviceTraits {
  bool fused_floats = false;  ///< fma() of floats rounds once, refined division is right, nothing is contracted
  bool fused_doubles = false; ///< fma() of doubles rounds once
  bool half_bytes = false;    ///< denormal halves convert exactly
  uint32_t subgroup_size = 0; ///< lanes
  bool partitioned = false;   ///< VK_NV_shader_subgroup_partitioned
  bool statistics = false;    ///< Kernel::statistics() has values
};

/// Limits of acceleration structures and ray tracing pipelines; zero unless GpuConfig::structures is kDriver.
struct StructureLimits {
  uint32_t group_handle_bytes = 0, group_base_alignment = 0; ///< of shader groups
  uint32_t scratch_alignment = 0;
  uint64_t max_primitives = 0, max_instances = 0; ///< of a structure
};

/// An open Vulkan device with one compute queue. All functions may be called from several threads.
class Device {
public:
  /// Throws Error(kUnsupported) if there is no loader, or no device with the features that kernels need.
  static std::shared_ptr<Device> open(const GpuConfig& config);
  /// Returns the device of an earlier call with an equal configuration if it is still in use and works, else open().
  static std::shared_ptr<Device> share(const GpuConfig& config);
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  /// Whether it stopped working.
  bool lost() const { return lost_; }
  const GpuConfig& config() const { return config_; }
  std::string name() const { return properties_.deviceName; }
  bool on_cpu() const { return properties_.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU; }
  const VkPhysicalDeviceLimits& limits() const { return properties_.limits; }
  const DeviceTraits& traits() const { return traits_; }
  const StructureLimits& structure_limits() const { return structure_limits_; }
  VkDevice handle() const { return device_; }

  /// Runs a kernel and waits. Returns its time in ms.
  /// @param push push constants
  /// Throws DeviceLost.
  double run(const Kernel& kernel, std::span<const std::byte> push, uint32_t groups);
  /// Runs commands and waits. Returns the time of each dispatch in ms, or an empty list on CPU devices and devices
  /// without timestamps. Throws DeviceLost.
  std::vector<double> run(const Commands& commands);
  /// Records commands by a function, runs them and waits. Returns their time in ms. Throws DeviceLost.
  double run(const std::function<void(VkCommandBuffer)>& record);
  /// Copies bytes between buffers and waits. Returns the time in ms.
  double copy(const Buffer& from, const Buffer& to, uint64_t from_offset, uint64_t to_offset, uint64_t bytes);
  /// Sets all words of a buffer and waits.
  void fill(const Buffer& buffer, uint32_t word);

  /// Bytes of all buffers.
  uint64_t allocated_bytes() const { return allocated_; }
  /// Bytes that buffers may have: those of the device's memory, or GpuConfig::memory_limit_bytes if that is less.
  uint64_t memory_bytes() const;

  /// Messages of the validation layer so far. Empty without GpuConfig::validation.
  std::vector<std::string> validation_messages() const;
  /// Whether the validation layer was requested and found.
  bool validates() const { return messenger_ != VK_NULL_HANDLE; }

private:
  friend class Buffer;

  explicit Device(const GpuConfig& config) : config_(config) {}
  void create_instance();
  void choose_device();
  void create_device();
  uint32_t memory_type(uint32_t allowed, bool host_visible) const;
  template <typename Record>
  double submit(const Record& record, std::span<double> times = {});
  void record(const Commands& commands);

  const GpuConfig config_;
  VkInstance instance_ = VK_NULL_HANDLE;
  VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
  /// volk's function pointers belong to the instance that was loaded last, which may lack the extension.
  PFN_vkDestroyDebugUtilsMessengerEXT destroy_messenger_ = nullptr;
  VkPhysicalDevice physical_ = VK_NULL_HANDLE;
  VkPhysicalDeviceProperties properties_{};
  VkPhysicalDeviceMemoryProperties memory_{};
  uint32_t family_ = 0;
  VkDevice device_ = VK_NULL_HANDLE;
  VkQueue queue_ = VK_NULL_HANDLE;
  VkCommandPool pool_ = VK_NULL_HANDLE;
  VkCommandBuffer commands_ = VK_NULL_HANDLE;
  VkFence fence_ = VK_NULL_HANDLE;
  VkQueryPool queries_ = VK_NULL_HANDLE;
  uint64_t stamp_mask_ = ~uint64_t{0}; ///< valid bits of timestamps
  DeviceTraits traits_;
  StructureLimits structure_limits_;
  std::mutex queue_mutex_;
  std::atomic<uint64_t> allocated_ = 0;
  std::atomic<bool> lost_ = false;
};

/// The names of all Vulkan devices, as GpuConfig::device finds them, with a note for those that lack features. Throws
/// Error(kUnsupported) without a loader.
std::vector<std::string> device_names(const GpuConfig& config);

} // namespace packtrace::gpu
