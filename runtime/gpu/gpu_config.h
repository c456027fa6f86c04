#pragma once

#include <cstdint>
#include <string>

namespace packtrace {

/// How kernels compute float operations that must round once.
enum class GpuArithmetic : uint8_t {
  kProbed, ///< probed when the device is opened
  kExact,  ///< emulated by doubles: the same bits on every device
};

/// What rays traverse on a device.
enum class GpuStructures : uint8_t {
  kPacked, ///< the packed nodes and clusters of the file, with the CPU's hits
  kDriver, ///< acceleration structures of the Vulkan driver over decoded triangles
};

/// Which of two kernels with the same results traces occlusion rays through packed nodes.
enum class GpuOcclusion : uint8_t {
  kFaster, ///< the one that took less time recently
  kWalk,   ///< occlusion_count.comp and occlusion_nearest.comp
  kQueue,  ///< occlusion_queue.comp, where it can run
};

/// Choice of a Vulkan device, and limits. The defaults are right for pictures; the rest serves tests.
struct GpuConfig {
  /// Part of the device's name, in any case. Empty: a discrete GPU, else an integrated or virtual one, but never a
  /// device that runs on the CPU.
  std::string device;
  uint64_t memory_limit_bytes = 0; ///< limit of allocated device memory; 0: the size of the device memory
  GpuArithmetic arithmetic = GpuArithmetic::kProbed;
  GpuStructures structures = GpuStructures::kPacked;
  GpuOcclusion occlusion = GpuOcclusion::kFaster;
  double dispatch_ms = 50.0;             ///< time that a dispatch should take at most; work is split accordingly
  bool statistics = false;               ///< collect the compiler's statistics of kernels, where the driver has them
  bool validation = false;               ///< Vulkan's validation layer, where it is installed
  std::string loader = "libvulkan.so.1"; ///< shared library of the Vulkan loader

  bool operator==(const GpuConfig&) const = default;
};

} // namespace packtrace
