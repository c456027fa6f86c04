#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <mutex>
#include <string>
#include <vector>

#include "pbrt_import/base/error.h"
#include "runtime/gpu/device/commands.h"
#include "runtime/gpu/device/device.h"
#include "runtime/gpu/device/device_features.h"
#include "runtime/gpu/device/loader.h"
#include "runtime/gpu/device/rounding_probe.h"

namespace packtrace::gpu {
namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";

std::vector<VkPhysicalDevice> physical_devices(VkInstance instance) {
  uint32_t count = 0;
  check(vkEnumeratePhysicalDevices(instance, &count, nullptr), "vkEnumeratePhysicalDevices");
  std::vector<VkPhysicalDevice> devices(count);
  if (count > 0) check(vkEnumeratePhysicalDevices(instance, &count, devices.data()), "vkEnumeratePhysicalDevices");
  devices.resize(count);
  return devices;
}

VkPhysicalDeviceProperties properties_of(VkPhysicalDevice device) {
  VkPhysicalDeviceProperties properties;
  vkGetPhysicalDeviceProperties(device, &properties);
  return properties;
}

bool has_extension(VkPhysicalDevice device, const char* name) {
  uint32_t count = 0;
  vkEnumerateDeviceExtensionProperties(device, nullptr, &count, nullptr);
  std::vector<VkExtensionProperties> extensions(count);
  vkEnumerateDeviceExtensionProperties(device, nullptr, &count, extensions.data());
  return std::ranges::any_of(extensions, [&](const auto& e) { return std::strcmp(e.extensionName, name) == 0; });
}

/// The first queue family that computes; none: the number of families.
uint32_t compute_family(VkPhysicalDevice device, std::vector<VkQueueFamilyProperties>& families) {
  uint32_t count = 0;
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
  families.resize(count);
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
  uint32_t family = 0;
  while (family < count && (families[family].queueFlags & VK_QUEUE_COMPUTE_BIT) == 0) ++family;
  return family;
}

VkPhysicalDeviceSubgroupProperties subgroups_of(VkPhysicalDevice device) {
  VkPhysicalDeviceSubgroupProperties subgroups{};
  subgroups.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_PROPERTIES;
  VkPhysicalDeviceProperties2 more{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &subgroups, {}};
  vkGetPhysicalDeviceProperties2(device, &more);
  return subgroups;
}

constexpr std::array kStructureExtensions = {VK_KHR_ACCELERATION_STRUCTURE_EXTENSION_NAME,
                                             VK_KHR_DEFERRED_HOST_OPERATIONS_EXTENSION_NAME,
                                             VK_KHR_RAY_TRACING_PIPELINE_EXTENSION_NAME};

/// The features of acceleration structures and ray tracing pipelines, chained for the driver.
struct StructureFeatures {
  StructureFeatures() {
    addresses.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_BUFFER_DEVICE_ADDRESS_FEATURES;
    structures.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ACCELERATION_STRUCTURE_FEATURES_KHR;
    pipelines.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_TRACING_PIPELINE_FEATURES_KHR;
    addresses.pNext = &structures, structures.pNext = &pipelines;
  }
  StructureFeatures(const StructureFeatures&) = delete;

  void require() {
    addresses.bufferDeviceAddress = VK_TRUE, structures.accelerationStructure = VK_TRUE;
    pipelines.rayTracingPipeline = VK_TRUE;
  }
  bool there() const {
    return addresses.bufferDeviceAddress == VK_TRUE && structures.accelerationStructure == VK_TRUE &&
           pipelines.rayTracingPipeline == VK_TRUE;
  }

  VkPhysicalDeviceBufferDeviceAddressFeatures addresses{};
  VkPhysicalDeviceAccelerationStructureFeaturesKHR structures{};
  VkPhysicalDeviceRayTracingPipelineFeaturesKHR pipelines{};
};

bool has_structures(VkPhysicalDevice device) {
  for (const char* const extension : kStructureExtensions)
    if (!has_extension(device, extension)) return false;
  StructureFeatures features;
  VkPhysicalDeviceFeatures2 all{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, &features.addresses, {}};
  vkGetPhysicalDeviceFeatures2(device, &all);
  return features.there();
}

StructureLimits structure_limits_of(VkPhysicalDevice device) {
  VkPhysicalDeviceAccelerationStructurePropertiesKHR structures{};
  structures.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ACCELERATION_STRUCTURE_PROPERTIES_KHR;
  VkPhysicalDeviceRayTracingPipelinePropertiesKHR pipelines{};
  pipelines.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_TRACING_PIPELINE_PROPERTIES_KHR;
  pipelines.pNext = &structures;
  VkPhysicalDeviceProperties2 more{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &pipelines, {}};
  vkGetPhysicalDeviceProperties2(device, &more);
  return {pipelines.shaderGroupHandleSize, pipelines.shaderGroupBaseAlignment,
          structures.minAccelerationStructureScratchOffsetAlignment, structures.maxPrimitiveCount,
          structures.maxInstanceCount};
}

DeviceFeatures features_of(VkPhysicalDevice device) {
  const VkPhysicalDeviceProperties properties = properties_of(device);
  DeviceFeatures out;
  out.api_version = properties.apiVersion;
  if (properties.apiVersion < VK_API_VERSION_1_1) return out; // has no functions that query subgroups
  VkPhysicalDeviceFeatures features;
  vkGetPhysicalDeviceFeatures(device, &features);
  std::vector<VkQueueFamilyProperties> families;
  out.int64 = features.shaderInt64 == VK_TRUE, out.float64 = features.shaderFloat64 == VK_TRUE;
  out.subgroups = subgroups_of(device).supportedOperations;
  out.storage_buffers = properties.limits.maxPerStageDescriptorStorageBuffers;
  out.computes = compute_family(device, families) < families.size();
  out.structures = has_structures(device);
  return out;
}

std::string lower_case(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

/// Higher is better; 0: only by name.
int rank(VkPhysicalDeviceType type) {
  switch (type) {
  case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
    return 3;
  case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
    return 2;
  case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
    return 1;
  default:
    return 0;
  }
}

/// Messages of all devices of the process.
struct Messages {
  std::mutex mutex;
  std::vector<std::string> texts;
};
Messages& messages() {
  static Messages all;
  return all;
}

VkBool32 VKAPI_PTR add_message(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                               const VkDebugUtilsMessengerCallbackDataEXT* data, void*) {
  const std::lock_guard lock(messages().mutex);
  messages().texts.emplace_back(data->pMessage);
  return VK_FALSE;
}

bool has_validation_layer() {
  uint32_t count = 0;
  vkEnumerateInstanceLayerProperties(&count, nullptr);
  std::vector<VkLayerProperties> layers(count);
  vkEnumerateInstanceLayerProperties(&count, layers.data());
  return std::ranges::any_of(layers, [](const auto& l) { return std::strcmp(l.layerName, kValidationLayer) == 0; });
}

} // namespace

std::vector<std::string> Device::validation_messages() const {
  const std::lock_guard lock(messages().mutex);
  return messages().texts;
}

void Device::create_instance() {
  VkApplicationInfo application{};
  application.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
  application.pApplicationName = "packtrace";
  application.apiVersion = VK_API_VERSION_1_2;
  VkInstanceCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
  info.pApplicationInfo = &application;
  const bool validates = config_.validation && has_validation_layer();
  const char* const extension = VK_EXT_DEBUG_UTILS_EXTENSION_NAME;
  if (validates) {
    info.enabledLayerCount = 1, info.ppEnabledLayerNames = &kValidationLayer;
    info.enabledExtensionCount = 1, info.ppEnabledExtensionNames = &extension;
  }
  if (vkCreateInstance(&info, nullptr, &instance_) != VK_SUCCESS)
    throw Error(ErrorKind::kUnsupported, no_device_message("no Vulkan driver found"));
  volkLoadInstance(instance_);
  if (!validates) return;
  VkDebugUtilsMessengerCreateInfoEXT messenger{};
  messenger.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT;
  messenger.messageSeverity =
      VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
  messenger.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT;
  messenger.pfnUserCallback = add_message;
  check(vkCreateDebugUtilsMessengerEXT(instance_, &messenger, nullptr, &messenger_), "vkCreateDebugUtilsMessengerEXT");
  destroy_messenger_ = vkDestroyDebugUtilsMessengerEXT;
}

void Device::choose_device() {
  const std::string wanted = lower_case(config_.device);
  int best = -1;
  std::string lacking;
  for (const VkPhysicalDevice device : physical_devices(instance_)) {
    const VkPhysicalDeviceProperties properties = properties_of(device);
    if (!wanted.empty() && lower_case(properties.deviceName).find(wanted) == std::string::npos) continue;
    const int value = rank(properties.deviceType);
    if (wanted.empty() && value == 0) continue;
    if (const std::string missing = missing_features(features_of(device), config_.structures); !missing.empty()) {
      lacking += (lacking.empty() ? "" : "; ") + std::string(properties.deviceName) + " lacks " + missing;
      continue;
    }
    if (value > best) best = value, physical_ = device;
  }
  if (best < 0)
    throw Error(ErrorKind::kUnsupported,
                no_device_message(!lacking.empty() ? "no usable Vulkan device found: " + lacking
                                  : wanted.empty()
                                      ? "no Vulkan device found that is a GPU"
                                      : "no Vulkan device with \"" + config_.device + "\" in its name found"));
  properties_ = properties_of(physical_);
  vkGetPhysicalDeviceMemoryProperties(physical_, &memory_);
}

void Device::create_device() {
  std::vector<VkQueueFamilyProperties> families;
  family_ = compute_family(physical_, families);
  const float priority = 1.0f;
  VkDeviceQueueCreateInfo queue{};
  queue.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO;
  queue.queueFamilyIndex = family_;
  queue.queueCount = 1;
  queue.pQueuePriorities = &priority;
  VkPhysicalDeviceFeatures features{};
  features.shaderInt64 = VK_TRUE, features.shaderFloat64 = VK_TRUE;
  VkDeviceCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
  info.queueCreateInfoCount = 1;
  info.pQueueCreateInfos = &queue;
  info.pEnabledFeatures = &features;
  std::vector<const char*> extensions;
  traits_.partitioned = has_extension(physical_, VK_NV_SHADER_SUBGROUP_PARTITIONED_EXTENSION_NAME);
  if (traits_.partitioned) extensions.push_back(VK_NV_SHADER_SUBGROUP_PARTITIONED_EXTENSION_NAME);
  StructureFeatures structures;
  if (config_.structures == GpuStructures::kDriver) {
    extensions.insert(extensions.end(), kStructureExtensions.begin(), kStructureExtensions.end());
    structures.require();
    info.pNext = &structures.addresses;
  }
  VkPhysicalDevicePipelineExecutablePropertiesFeaturesKHR statistics{};
  statistics.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PIPELINE_EXECUTABLE_PROPERTIES_FEATURES_KHR;
  statistics.pNext = const_cast<void*>(info.pNext), statistics.pipelineExecutableInfo = VK_TRUE;
  traits_.statistics =
      config_.statistics && has_extension(physical_, VK_KHR_PIPELINE_EXECUTABLE_PROPERTIES_EXTENSION_NAME);
  if (traits_.statistics) {
    extensions.push_back(VK_KHR_PIPELINE_EXECUTABLE_PROPERTIES_EXTENSION_NAME);
    info.pNext = &statistics;
  }
  info.enabledExtensionCount = static_cast<uint32_t>(extensions.size());
  info.ppEnabledExtensionNames = extensions.data();
  check(vkCreateDevice(physical_, &info, nullptr, &device_), "vkCreateDevice");
  if (config_.structures == GpuStructures::kDriver) structure_limits_ = structure_limits_of(physical_);
  vkGetDeviceQueue(device_, family_, 0, &queue_);
  const VkCommandPoolCreateInfo pool{VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO, nullptr, 0, family_};
  check(vkCreateCommandPool(device_, &pool, nullptr, &pool_), "vkCreateCommandPool");
  const VkCommandBufferAllocateInfo commands{VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO, nullptr, pool_,
                                             VK_COMMAND_BUFFER_LEVEL_PRIMARY, 1};
  check(vkAllocateCommandBuffers(device_, &commands, &commands_), "vkAllocateCommandBuffers");
  const VkFenceCreateInfo fence{VK_STRUCTURE_TYPE_FENCE_CREATE_INFO, nullptr, 0};
  check(vkCreateFence(device_, &fence, nullptr, &fence_), "vkCreateFence");
  const uint32_t stamp_bits = families[family_].timestampValidBits;
  if (stamp_bits == 0) return;
  stamp_mask_ = ~uint64_t{0} >> (64 - stamp_bits);
  VkQueryPoolCreateInfo queries{};
  queries.sType = VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO;
  queries.queryType = VK_QUERY_TYPE_TIMESTAMP;
  queries.queryCount = 2 + 2 * Commands::kMaxDispatches;
  check(vkCreateQueryPool(device_, &queries, nullptr, &queries_), "vkCreateQueryPool");
}

Device::~Device() {
  if (device_ != VK_NULL_HANDLE) {
    vkDestroyQueryPool(device_, queries_, nullptr);
    vkDestroyFence(device_, fence_, nullptr);
    vkDestroyCommandPool(device_, pool_, nullptr);
    vkDestroyDevice(device_, nullptr);
  }
  if (messenger_ != VK_NULL_HANDLE) destroy_messenger_(instance_, messenger_, nullptr);
  if (instance_ != VK_NULL_HANDLE) vkDestroyInstance(instance_, nullptr);
}

std::shared_ptr<Device> Device::open(const GpuConfig& config) {
  open_loader(config.loader);
  std::shared_ptr<Device> device(new Device(config));
  device->create_instance();
  device->choose_device();
  device->create_device();
  device->traits_.subgroup_size = subgroups_of(device->physical_).subgroupSize;
  if (config.arithmetic == GpuArithmetic::kProbed) probe_rounding(device, device->traits_);
  return device;
}

std::shared_ptr<Device> Device::share(const GpuConfig& config) {
  static std::mutex mutex;
  static std::vector<std::weak_ptr<Device>> opened;
  const std::lock_guard lock(mutex);
  std::erase_if(opened, [](const std::weak_ptr<Device>& device) { return device.expired(); });
  for (const std::weak_ptr<Device>& weak : opened)
    if (const std::shared_ptr<Device> device = weak.lock(); device && !device->lost() && device->config() == config)
      return device;
  const std::shared_ptr<Device> device = open(config);
  opened.push_back(device);
  return device;
}

std::vector<std::string> device_names(const GpuConfig& config) {
  open_loader(config.loader);
  VkApplicationInfo application{};
  application.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
  application.apiVersion = VK_API_VERSION_1_2;
  VkInstanceCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
  info.pApplicationInfo = &application;
  VkInstance instance = VK_NULL_HANDLE;
  if (vkCreateInstance(&info, nullptr, &instance) != VK_SUCCESS) return {};
  volkLoadInstance(instance);
  std::vector<std::string> names;
  for (const VkPhysicalDevice device : physical_devices(instance)) {
    const std::string missing = missing_features(features_of(device), config.structures);
    names.push_back(properties_of(device).deviceName + (missing.empty() ? std::string() : " (lacks " + missing + ")"));
  }
  vkDestroyInstance(instance, nullptr);
  return names;
}

} // namespace packtrace::gpu
