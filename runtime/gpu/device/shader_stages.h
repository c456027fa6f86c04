#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/gpu/device/device.h"

namespace packtrace::gpu {

/// The shaders of a pipeline with their specialization constants. Needed until the pipeline exists.
class ShaderStages {
public:
  /// @param constants values of the specialization constants 0, 1, ... of all shaders; must outlive this object
  ShaderStages(const Device& device, std::span<const uint32_t> constants) : device_(device) {
    for (uint32_t i = 0; i < constants.size(); ++i)
      entries_.push_back({i, i * static_cast<uint32_t>(sizeof(uint32_t)), sizeof(uint32_t)});
    special_ = {static_cast<uint32_t>(entries_.size()), entries_.data(), constants.size_bytes(), constants.data()};
  }
  ~ShaderStages() {
    for (const VkShaderModule module : modules_) vkDestroyShaderModule(device_.handle(), module, nullptr);
  }
  ShaderStages(const ShaderStages&) = delete;
  ShaderStages& operator=(const ShaderStages&) = delete;

  VkPipelineShaderStageCreateInfo make(VkShaderStageFlagBits stage, std::span<const uint32_t> spirv) {
    VkShaderModuleCreateInfo code{};
    code.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO;
    code.codeSize = spirv.size_bytes(), code.pCode = spirv.data();
    VkShaderModule module = VK_NULL_HANDLE;
    check(vkCreateShaderModule(device_.handle(), &code, nullptr, &module), "vkCreateShaderModule");
    modules_.push_back(module);
    VkPipelineShaderStageCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
    info.stage = stage, info.module = module, info.pName = "main", info.pSpecializationInfo = &special_;
    return info;
  }

private:
  const Device& device_;
  std::vector<VkSpecializationMapEntry> entries_;
  VkSpecializationInfo special_{};
  std::vector<VkShaderModule> modules_;
};

} // namespace packtrace::gpu
