#pragma once

#include <string>

#include "runtime/gpu/device/vulkan_api.h"
#include "runtime/gpu/gpu_config.h"

namespace packtrace::gpu {

/// Features of a device that kernels need.
struct DeviceFeatures {
  uint32_t api_version = 0;
  bool int64 = false, float64 = false;
  VkSubgroupFeatureFlags subgroups = 0;
  uint32_t storage_buffers = 0; ///< of a kernel
  bool computes = false;        ///< has a compute queue
  bool structures = false;      ///< has acceleration structures and ray tracing pipelines
};

/// Returns the names of the features that tracing through `structures` needs and the device lacks; empty if it has all.
std::string missing_features(const DeviceFeatures& device, GpuStructures structures);

} // namespace packtrace::gpu
