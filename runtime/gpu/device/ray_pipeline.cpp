// The part of Kernel that makes ray tracing pipelines.

#include <array>
#include <cstring>
#include <utility>
#include <vector>

#include "runtime/gpu/device/buffer.h"
#include "runtime/gpu/device/kernel.h"
#include "runtime/gpu/device/shader_stages.h"

namespace packtrace::gpu {
namespace {

constexpr VkShaderStageFlags kHitStages = VK_SHADER_STAGE_CLOSEST_HIT_BIT_KHR | VK_SHADER_STAGE_ANY_HIT_BIT_KHR;
constexpr uint32_t kGroups = 3; ///< of shaders: ray generation, miss, hit

VkRayTracingShaderGroupCreateInfoKHR group_of(uint32_t general, uint32_t closest, uint32_t any) {
  VkRayTracingShaderGroupCreateInfoKHR group{};
  group.sType = VK_STRUCTURE_TYPE_RAY_TRACING_SHADER_GROUP_CREATE_INFO_KHR;
  group.type = general != VK_SHADER_UNUSED_KHR ? VK_RAY_TRACING_SHADER_GROUP_TYPE_GENERAL_KHR
                                               : VK_RAY_TRACING_SHADER_GROUP_TYPE_TRIANGLES_HIT_GROUP_KHR;
  group.generalShader = general, group.closestHitShader = closest, group.anyHitShader = any;
  group.intersectionShader = VK_SHADER_UNUSED_KHR;
  return group;
}

} // namespace

Kernel::Kernel(std::shared_ptr<Device> device, std::span<const uint32_t> spirv, const HitShaders& hit_shaders,
               std::span<const uint32_t> constants, uint32_t bindings, uint32_t push_bytes)
    : Kernel(std::move(device)) {
  traces_ = true;
  push_stages_ = VK_SHADER_STAGE_RAYGEN_BIT_KHR;
  constexpr VkShaderStageFlags kAll = VK_SHADER_STAGE_RAYGEN_BIT_KHR | kHitStages;
  std::vector<VkDescriptorSetLayoutBinding> all;
  for (uint32_t i = 0; i < bindings; ++i) all.push_back({i, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, kAll, nullptr});
  for (const uint32_t binding : {kRangesBinding, kInstancesBinding})
    all.push_back({binding, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, kHitStages, nullptr});
  all.push_back(
      {kStructureBinding, VK_DESCRIPTOR_TYPE_ACCELERATION_STRUCTURE_KHR, 1, VK_SHADER_STAGE_RAYGEN_BIT_KHR, nullptr});
  create_layout(all, push_bytes);
  create_ray_pipeline(spirv, hit_shaders, constants);
  create_shader_table();
}

void Kernel::create_ray_pipeline(std::span<const uint32_t> spirv, const HitShaders& hit_shaders,
                                 std::span<const uint32_t> constants) {
  ShaderStages shaders(*device_, constants);
  const std::array stages = {shaders.make(VK_SHADER_STAGE_RAYGEN_BIT_KHR, spirv),
                             shaders.make(VK_SHADER_STAGE_MISS_BIT_KHR, hit_shaders.miss),
                             shaders.make(VK_SHADER_STAGE_CLOSEST_HIT_BIT_KHR, hit_shaders.closest),
                             shaders.make(VK_SHADER_STAGE_ANY_HIT_BIT_KHR, hit_shaders.any)};
  const std::array<VkRayTracingShaderGroupCreateInfoKHR, kGroups> groups = {
      group_of(0, VK_SHADER_UNUSED_KHR, VK_SHADER_UNUSED_KHR), group_of(1, VK_SHADER_UNUSED_KHR, VK_SHADER_UNUSED_KHR),
      group_of(VK_SHADER_UNUSED_KHR, 2, 3)};
  VkRayTracingPipelineCreateInfoKHR info{};
  info.sType = VK_STRUCTURE_TYPE_RAY_TRACING_PIPELINE_CREATE_INFO_KHR;
  info.stageCount = static_cast<uint32_t>(stages.size()), info.pStages = stages.data();
  info.groupCount = kGroups, info.pGroups = groups.data();
  info.maxPipelineRayRecursionDepth = 1;
  info.layout = layout_;
  if (device_->traits().statistics) info.flags = VK_PIPELINE_CREATE_CAPTURE_STATISTICS_BIT_KHR;
  check(
      vkCreateRayTracingPipelinesKHR(device_->handle(), VK_NULL_HANDLE, VK_NULL_HANDLE, 1, &info, nullptr, &pipeline_),
      "vkCreateRayTracingPipelinesKHR");
}

/// Lays the handles of the shader groups out, each at an address that may begin a table.
void Kernel::create_shader_table() {
  const StructureLimits& limits = device_->structure_limits();
  const uint64_t handle = limits.group_handle_bytes, alignment = limits.group_base_alignment;
  table_stride_ = (handle + alignment - 1) / alignment * alignment;
  std::vector<std::byte> handles(kGroups * handle), table(kGroups * table_stride_);
  check(vkGetRayTracingShaderGroupHandlesKHR(device_->handle(), pipeline_, 0, kGroups, handles.size(), handles.data()),
        "vkGetRayTracingShaderGroupHandlesKHR");
  for (uint32_t i = 0; i < kGroups; ++i)
    std::memcpy(table.data() + i * table_stride_, handles.data() + i * handle, handle);
  shader_table_ = std::make_unique<Buffer>(upload(device_, table, "shader groups"));
}

void Kernel::bind(VkAccelerationStructureKHR structure) {
  VkWriteDescriptorSetAccelerationStructureKHR what{};
  what.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET_ACCELERATION_STRUCTURE_KHR;
  what.accelerationStructureCount = 1, what.pAccelerationStructures = &structure;
  VkWriteDescriptorSet write{};
  write.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
  write.pNext = &what;
  write.dstSet = set_, write.dstBinding = kStructureBinding;
  write.descriptorCount = 1, write.descriptorType = VK_DESCRIPTOR_TYPE_ACCELERATION_STRUCTURE_KHR;
  vkUpdateDescriptorSets(device_->handle(), 1, &write, 0, nullptr);
}

} // namespace packtrace::gpu
