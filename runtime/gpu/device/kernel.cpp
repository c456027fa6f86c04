#include "runtime/gpu/device/kernel.h"

#include <utility>
#include <vector>

#include "runtime/gpu/device/buffer.h"
#include "runtime/gpu/device/shader_stages.h"

namespace packtrace::gpu {

Kernel::Kernel(std::shared_ptr<Device> device, std::span<const uint32_t> spirv, std::span<const uint32_t> constants,
               uint32_t bindings, uint32_t push_bytes)
    : Kernel(std::move(device)) { // from here on the destructor runs, whatever is thrown
  std::vector<VkDescriptorSetLayoutBinding> buffers;
  for (uint32_t i = 0; i < bindings; ++i)
    buffers.push_back({i, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr});
  create_layout(buffers, push_bytes);
  create_pipeline(spirv, constants);
}

Kernel::Kernel(std::shared_ptr<Device> device) : device_(std::move(device)) {}

void Kernel::create_layout(std::span<const VkDescriptorSetLayoutBinding> bindings, uint32_t push_bytes) {
  const VkDevice device = device_->handle();
  const auto count = static_cast<uint32_t>(bindings.size());
  const VkDescriptorSetLayoutCreateInfo set{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO, nullptr, 0, count,
                                            bindings.data()};
  check(vkCreateDescriptorSetLayout(device, &set, nullptr, &set_layout_), "vkCreateDescriptorSetLayout");
  const VkPushConstantRange push{push_stages_, 0, push_bytes};
  const VkPipelineLayoutCreateInfo layout{
      VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO, nullptr, 0, 1, &set_layout_, push_bytes > 0 ? 1u : 0u, &push};
  check(vkCreatePipelineLayout(device, &layout, nullptr, &layout_), "vkCreatePipelineLayout");
  const VkDescriptorPoolSize sizes[] = {{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, count},
                                        {VK_DESCRIPTOR_TYPE_ACCELERATION_STRUCTURE_KHR, 1}};
  const VkDescriptorPoolCreateInfo pool{
      VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO, nullptr, 0, 1, traces_ ? 2u : 1u, sizes};
  check(vkCreateDescriptorPool(device, &pool, nullptr, &pool_), "vkCreateDescriptorPool");
  const VkDescriptorSetAllocateInfo allocate{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO, nullptr, pool_, 1,
                                             &set_layout_};
  check(vkAllocateDescriptorSets(device, &allocate, &set_), "vkAllocateDescriptorSets");
}

void Kernel::create_pipeline(std::span<const uint32_t> spirv, std::span<const uint32_t> constants) {
  ShaderStages stages(*device_, constants);
  VkComputePipelineCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO;
  info.stage = stages.make(VK_SHADER_STAGE_COMPUTE_BIT, spirv);
  info.layout = layout_;
  if (device_->traits().statistics) info.flags = VK_PIPELINE_CREATE_CAPTURE_STATISTICS_BIT_KHR;
  check(vkCreateComputePipelines(device_->handle(), VK_NULL_HANDLE, 1, &info, nullptr, &pipeline_),
        "vkCreateComputePipelines");
}

void Kernel::record(VkCommandBuffer commands, std::span<const std::byte> push, uint32_t groups_x,
                    uint32_t groups_y) const {
  const VkPipelineBindPoint point = traces_ ? VK_PIPELINE_BIND_POINT_RAY_TRACING_KHR : VK_PIPELINE_BIND_POINT_COMPUTE;
  vkCmdBindPipeline(commands, point, pipeline_);
  vkCmdBindDescriptorSets(commands, point, layout_, 0, 1, &set_, 0, nullptr);
  if (!push.empty())
    vkCmdPushConstants(commands, layout_, push_stages_, 0, static_cast<uint32_t>(push.size()), push.data());
  if (!traces_) {
    vkCmdDispatch(commands, groups_x, groups_y, 1);
    return;
  }
  const uint64_t table = shader_table_->address();
  const VkStridedDeviceAddressRegionKHR generation{table, table_stride_, table_stride_},
      miss{table + table_stride_, table_stride_, table_stride_},
      hit{table + 2 * table_stride_, table_stride_, table_stride_}, none{};
  vkCmdTraceRaysKHR(commands, &generation, &miss, &hit, &none, groups_x * kGroupThreads, groups_y, 1);
}

void Kernel::bind(uint32_t binding, const Buffer& buffer) {
  const VkDescriptorBufferInfo info{buffer.handle(), 0, VK_WHOLE_SIZE};
  VkWriteDescriptorSet write{};
  write.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
  write.dstSet = set_;
  write.dstBinding = binding;
  write.descriptorCount = 1;
  write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
  write.pBufferInfo = &info;
  vkUpdateDescriptorSets(device_->handle(), 1, &write, 0, nullptr);
}

std::vector<std::pair<std::string, double>> Kernel::statistics() const {
  std::vector<std::pair<std::string, double>> out;
  if (!device_->traits().statistics) return out;
  const VkDevice device = device_->handle();
  const VkPipelineInfoKHR pipeline{VK_STRUCTURE_TYPE_PIPELINE_INFO_KHR, nullptr, pipeline_};
  uint32_t count = 0;
  check(vkGetPipelineExecutablePropertiesKHR(device, &pipeline, &count, nullptr),
        "vkGetPipelineExecutablePropertiesKHR");
  VkPipelineExecutablePropertiesKHR blank{};
  blank.sType = VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_PROPERTIES_KHR;
  std::vector<VkPipelineExecutablePropertiesKHR> shaders(count, blank);
  check(vkGetPipelineExecutablePropertiesKHR(device, &pipeline, &count, shaders.data()),
        "vkGetPipelineExecutablePropertiesKHR");
  for (uint32_t i = 0; i < count; ++i) {
    const VkPipelineExecutableInfoKHR info{VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_INFO_KHR, nullptr, pipeline_, i};
    uint32_t values = 0;
    check(vkGetPipelineExecutableStatisticsKHR(device, &info, &values, nullptr),
          "vkGetPipelineExecutableStatisticsKHR");
    VkPipelineExecutableStatisticKHR none{};
    none.sType = VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_STATISTIC_KHR;
    std::vector<VkPipelineExecutableStatisticKHR> all(values, none);
    check(vkGetPipelineExecutableStatisticsKHR(device, &info, &values, all.data()),
          "vkGetPipelineExecutableStatisticsKHR");
    for (const VkPipelineExecutableStatisticKHR& s : all)
      out.emplace_back(std::string(shaders[i].name) + ", " + s.name,
                       s.format == VK_PIPELINE_EXECUTABLE_STATISTIC_FORMAT_FLOAT64_KHR
                           ? s.value.f64
                           : static_cast<double>(s.value.u64));
  }
  return out;
}

Kernel::~Kernel() {
  const VkDevice device = device_->handle();
  vkDestroyPipeline(device, pipeline_, nullptr);
  vkDestroyPipelineLayout(device, layout_, nullptr);
  vkDestroyDescriptorPool(device, pool_, nullptr);
  vkDestroyDescriptorSetLayout(device, set_layout_, nullptr);
}

} // namespace packtrace::gpu
