#include "tests/compress/vertex16/vulkan_compute.h"

#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>

#ifdef PACKTRACE_VOLK // volk's function pointers have the names of the loader's functions
#include "runtime/gpu/device/vulkan_api.h"
#else
#include <vulkan/vulkan.h>
#endif

namespace packtrace::test {
namespace {

void check(VkResult result, const char* what) {
  if (result != VK_SUCCESS) throw std::runtime_error(std::string(what) + ": VkResult " + std::to_string(result));
}

struct Buffer {
  VkBuffer buffer = VK_NULL_HANDLE;
  VkDeviceMemory memory = VK_NULL_HANDLE;
  void* mapped = nullptr;
};

} // namespace

struct VulkanCompute::State {
  VkInstance instance = VK_NULL_HANDLE;
  VkPhysicalDevice physical = VK_NULL_HANDLE;
  VkDevice device = VK_NULL_HANDLE;
  VkQueue queue = VK_NULL_HANDLE;
  uint32_t family = 0, buffer_count = 0;
  VkShaderModule shader = VK_NULL_HANDLE;
  VkDescriptorSetLayout set_layout = VK_NULL_HANDLE;
  VkPipelineLayout layout = VK_NULL_HANDLE;
  VkPipeline pipeline = VK_NULL_HANDLE;
  VkDescriptorPool descriptors = VK_NULL_HANDLE;
  VkCommandPool commands = VK_NULL_HANDLE;

  ~State() {
    if (device != VK_NULL_HANDLE) {
      vkDestroyCommandPool(device, commands, nullptr);
      vkDestroyDescriptorPool(device, descriptors, nullptr);
      vkDestroyPipeline(device, pipeline, nullptr);
      vkDestroyPipelineLayout(device, layout, nullptr);
      vkDestroyDescriptorSetLayout(device, set_layout, nullptr);
      vkDestroyShaderModule(device, shader, nullptr);
      vkDestroyDevice(device, nullptr);
    }
    if (instance != VK_NULL_HANDLE) vkDestroyInstance(instance, nullptr);
  }

  /// Returns false if there is no device.
  bool find_device(std::string& name) {
    VkApplicationInfo application{
        VK_STRUCTURE_TYPE_APPLICATION_INFO, nullptr, "test", 0, nullptr, 0, VK_API_VERSION_1_0};
    VkInstanceCreateInfo create{};
    create.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
    create.pApplicationInfo = &application;
#ifdef PACKTRACE_VOLK
    if (volkInitialize() != VK_SUCCESS) return false;
#endif
    if (vkCreateInstance(&create, nullptr, &instance) != VK_SUCCESS) return false;
#ifdef PACKTRACE_VOLK
    volkLoadInstance(instance);
#endif
    uint32_t count = 0;
    vkEnumeratePhysicalDevices(instance, &count, nullptr);
    std::vector<VkPhysicalDevice> devices(count);
    vkEnumeratePhysicalDevices(instance, &count, devices.data());
    for (const VkPhysicalDevice one : devices) {
      VkPhysicalDeviceProperties properties;
      vkGetPhysicalDeviceProperties(one, &properties);
      const bool cpu = properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU;
      if (physical != VK_NULL_HANDLE && !cpu) continue;
      physical = one;
      name = properties.deviceName;
      if (cpu) break;
    }
    return physical != VK_NULL_HANDLE;
  }

  void make_device() {
    uint32_t count = 0;
    vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, families.data());
    while (family < count && (families[family].queueFlags & VK_QUEUE_COMPUTE_BIT) == 0) ++family;
    if (family == count) throw std::runtime_error("no compute queue");
    const float priority = 1.0f;
    VkDeviceQueueCreateInfo queues{};
    queues.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO;
    queues.queueFamilyIndex = family;
    queues.queueCount = 1;
    queues.pQueuePriorities = &priority;
    VkDeviceCreateInfo create{};
    create.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
    create.queueCreateInfoCount = 1;
    create.pQueueCreateInfos = &queues;
    check(vkCreateDevice(physical, &create, nullptr, &device), "vkCreateDevice");
    vkGetDeviceQueue(device, family, 0, &queue);
    VkCommandPoolCreateInfo pool{};
    pool.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
    pool.queueFamilyIndex = family;
    check(vkCreateCommandPool(device, &pool, nullptr, &commands), "vkCreateCommandPool");
  }

  void make_pipeline(const std::vector<char>& code) {
    VkShaderModuleCreateInfo module{};
    module.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO;
    module.codeSize = code.size();
    std::vector<uint32_t> words(code.size() / 4);
    std::memcpy(words.data(), code.data(), words.size() * 4);
    module.pCode = words.data();
    check(vkCreateShaderModule(device, &module, nullptr, &shader), "vkCreateShaderModule");
    std::vector<VkDescriptorSetLayoutBinding> bindings;
    for (uint32_t i = 0; i < buffer_count; ++i)
      bindings.push_back({i, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr});
    VkDescriptorSetLayoutCreateInfo sets{};
    sets.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
    sets.bindingCount = buffer_count;
    sets.pBindings = bindings.data();
    check(vkCreateDescriptorSetLayout(device, &sets, nullptr, &set_layout), "vkCreateDescriptorSetLayout");
    VkPipelineLayoutCreateInfo layouts{};
    layouts.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO;
    layouts.setLayoutCount = 1;
    layouts.pSetLayouts = &set_layout;
    check(vkCreatePipelineLayout(device, &layouts, nullptr, &layout), "vkCreatePipelineLayout");
    VkComputePipelineCreateInfo pipelines{};
    pipelines.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO;
    pipelines.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
    pipelines.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
    pipelines.stage.module = shader;
    pipelines.stage.pName = "main";
    pipelines.layout = layout;
    check(vkCreateComputePipelines(device, VK_NULL_HANDLE, 1, &pipelines, nullptr, &pipeline),
          "vkCreateComputePipelines");
    const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, buffer_count};
    VkDescriptorPoolCreateInfo pool{};
    pool.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO;
    pool.maxSets = 1;
    pool.poolSizeCount = 1;
    pool.pPoolSizes = &size;
    check(vkCreateDescriptorPool(device, &pool, nullptr, &descriptors), "vkCreateDescriptorPool");
  }

  Buffer make_buffer(size_t bytes) const {
    Buffer result;
    VkBufferCreateInfo create{};
    create.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
    create.size = bytes;
    create.usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
    check(vkCreateBuffer(device, &create, nullptr, &result.buffer), "vkCreateBuffer");
    VkMemoryRequirements needs;
    vkGetBufferMemoryRequirements(device, result.buffer, &needs);
    VkPhysicalDeviceMemoryProperties memory;
    vkGetPhysicalDeviceMemoryProperties(physical, &memory);
    constexpr uint32_t kWanted = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
    uint32_t type = 0;
    while (type < memory.memoryTypeCount && ((needs.memoryTypeBits & (1u << type)) == 0 ||
                                             (memory.memoryTypes[type].propertyFlags & kWanted) != kWanted))
      ++type;
    if (type == memory.memoryTypeCount) throw std::runtime_error("no memory that the host sees");
    const VkMemoryAllocateInfo allocate{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, nullptr, needs.size, type};
    check(vkAllocateMemory(device, &allocate, nullptr, &result.memory), "vkAllocateMemory");
    check(vkBindBufferMemory(device, result.buffer, result.memory, 0), "vkBindBufferMemory");
    check(vkMapMemory(device, result.memory, 0, VK_WHOLE_SIZE, 0, &result.mapped), "vkMapMemory");
    return result;
  }

  VkDescriptorSet bind(const std::vector<Buffer>& buffers) const {
    check(vkResetDescriptorPool(device, descriptors, 0), "vkResetDescriptorPool");
    VkDescriptorSetAllocateInfo allocate{};
    allocate.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO;
    allocate.descriptorPool = descriptors;
    allocate.descriptorSetCount = 1;
    allocate.pSetLayouts = &set_layout;
    VkDescriptorSet set = VK_NULL_HANDLE;
    check(vkAllocateDescriptorSets(device, &allocate, &set), "vkAllocateDescriptorSets");
    for (uint32_t i = 0; i < buffers.size(); ++i) {
      const VkDescriptorBufferInfo info{buffers[i].buffer, 0, VK_WHOLE_SIZE};
      VkWriteDescriptorSet write{};
      write.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
      write.dstSet = set;
      write.dstBinding = i;
      write.descriptorCount = 1;
      write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
      write.pBufferInfo = &info;
      vkUpdateDescriptorSets(device, 1, &write, 0, nullptr);
    }
    return set;
  }

  void dispatch(VkDescriptorSet set, uint32_t groups) const {
    VkCommandBufferAllocateInfo allocate{};
    allocate.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
    allocate.commandPool = commands;
    allocate.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
    allocate.commandBufferCount = 1;
    VkCommandBuffer buffer = VK_NULL_HANDLE;
    check(vkAllocateCommandBuffers(device, &allocate, &buffer), "vkAllocateCommandBuffers");
    VkCommandBufferBeginInfo begin{};
    begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
    check(vkBeginCommandBuffer(buffer, &begin), "vkBeginCommandBuffer");
    vkCmdBindPipeline(buffer, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline);
    vkCmdBindDescriptorSets(buffer, VK_PIPELINE_BIND_POINT_COMPUTE, layout, 0, 1, &set, 0, nullptr);
    vkCmdDispatch(buffer, groups, 1, 1);
    VkMemoryBarrier barrier{VK_STRUCTURE_TYPE_MEMORY_BARRIER, nullptr, VK_ACCESS_SHADER_WRITE_BIT,
                            VK_ACCESS_HOST_READ_BIT};
    vkCmdPipelineBarrier(buffer, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &barrier, 0,
                         nullptr, 0, nullptr);
    check(vkEndCommandBuffer(buffer), "vkEndCommandBuffer");
    VkSubmitInfo submit{};
    submit.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
    submit.commandBufferCount = 1;
    submit.pCommandBuffers = &buffer;
    check(vkQueueSubmit(queue, 1, &submit, VK_NULL_HANDLE), "vkQueueSubmit");
    check(vkQueueWaitIdle(queue), "vkQueueWaitIdle");
    vkFreeCommandBuffers(device, commands, 1, &buffer);
  }
};

VulkanCompute::~VulkanCompute() = default;

std::unique_ptr<VulkanCompute> VulkanCompute::create(const std::filesystem::path& spirv, uint32_t buffers) {
  std::unique_ptr<VulkanCompute> compute(new VulkanCompute);
  compute->state_ = std::make_unique<State>();
  State& state = *compute->state_;
  state.buffer_count = buffers;
  if (!state.find_device(compute->device_)) return nullptr;
  state.make_device();
  std::ifstream in(spirv, std::ios::binary);
  state.make_pipeline({std::istreambuf_iterator<char>(in), {}});
  return compute;
}

std::vector<std::byte> VulkanCompute::run(std::span<const std::span<const std::byte>> inputs, size_t output_bytes,
                                          uint32_t items) {
  std::vector<Buffer> buffers;
  for (const std::span<const std::byte> input : inputs) {
    buffers.push_back(state_->make_buffer(input.size()));
    std::memcpy(buffers.back().mapped, input.data(), input.size());
  }
  buffers.push_back(state_->make_buffer(output_bytes));
  state_->dispatch(state_->bind(buffers), (items + 63) / 64);
  std::vector<std::byte> output(output_bytes);
  std::memcpy(output.data(), buffers.back().mapped, output_bytes);
  for (const Buffer& buffer : buffers) {
    vkDestroyBuffer(state_->device, buffer.buffer, nullptr);
    vkFreeMemory(state_->device, buffer.memory, nullptr);
  }
  return output;
}

} // namespace packtrace::test
