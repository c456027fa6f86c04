#include "runtime/gpu/device/device_features.h"

namespace packtrace::gpu {

std::string missing_features(const DeviceFeatures& device, GpuStructures structures) {
  constexpr uint32_t kStorageBuffers = 16;
  constexpr VkSubgroupFeatureFlags kOperations = VK_SUBGROUP_FEATURE_BASIC_BIT | VK_SUBGROUP_FEATURE_VOTE_BIT |
                                                 VK_SUBGROUP_FEATURE_ARITHMETIC_BIT | VK_SUBGROUP_FEATURE_BALLOT_BIT |
                                                 VK_SUBGROUP_FEATURE_SHUFFLE_BIT;
  std::string missing;
  const auto need = [&](bool there, const char* name) {
    if (!there) missing += (missing.empty() ? "" : ", ") + std::string(name);
  };
  need(device.api_version >= VK_API_VERSION_1_2, "Vulkan 1.2");
  need(device.int64, "shaderInt64");
  need(device.float64, "shaderFloat64");
  need((device.subgroups & kOperations) == kOperations, "subgroup ballot, shuffle and arithmetic");
  need(device.storage_buffers >= kStorageBuffers, "16 storage buffers per kernel");
  need(device.computes, "a compute queue");
  need(structures == GpuStructures::kPacked || device.structures, "acceleration structures and ray tracing pipelines");
  return missing;
}

} // namespace packtrace::gpu
