#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "runtime/gpu/device/device.h"

namespace packtrace::gpu {

class Buffer;

/// The shaders of a ray tracing pipeline besides its ray generation shader. Each is SPIR-V, validated at build time.
struct HitShaders {
  std::span<const uint32_t> closest, any, miss;
};

/// A compute or ray tracing pipeline and the buffers that it reads and writes.
class Kernel {
public:
  static constexpr uint32_t kGroupThreads = 64; ///< rays of a group of kernels that have a thread per ray
  /// Bindings of ray tracing pipelines: two storage buffers that hit shaders read, and the acceleration structure.
  static constexpr uint32_t kRangesBinding = 12, kInstancesBinding = 13, kStructureBinding = 14;

  /// @param spirv module that was validated at build time
  /// @param constants values of the specialization constants 0, 1, ...
  /// @param bindings number of storage buffers, bound to 0, 1, ...
  Kernel(std::shared_ptr<Device> device, std::span<const uint32_t> spirv, std::span<const uint32_t> constants,
         uint32_t bindings, uint32_t push_bytes);
  /// A ray tracing pipeline: a group of Device::run() is kGroupThreads rays. Only on devices with
  /// GpuStructures::kDriver.
  /// @param spirv ray generation shader
  /// @param constants of all shaders
  /// @param bindings number of storage buffers, bound to 0, 1, ...; at most kRangesBinding
  Kernel(std::shared_ptr<Device> device, std::span<const uint32_t> spirv, const HitShaders& hit_shaders,
         std::span<const uint32_t> constants, uint32_t bindings, uint32_t push_bytes);
  ~Kernel();
  Kernel(const Kernel&) = delete;
  Kernel& operator=(const Kernel&) = delete;

  /// Binds a buffer, which must outlive the runs of this kernel.
  void bind(uint32_t binding, const Buffer& buffer);
  /// Statistics of the driver's compiler about the shaders, such as numbers of registers: shader and value, value.
  /// Empty without DeviceTraits::statistics.
  std::vector<std::pair<std::string, double>> statistics() const;
  /// Whether it is a ray tracing pipeline.
  bool traces_structures() const { return traces_; }
  /// Binds the acceleration structure of a ray tracing pipeline.
  void bind(VkAccelerationStructureKHR structure);

  /// Records the dispatch of all groups into the caller's command buffer.
  void record(VkCommandBuffer commands, std::span<const std::byte> push, uint32_t groups_x, uint32_t groups_y) const;

private:
  explicit Kernel(std::shared_ptr<Device> device);
  void create_layout(std::span<const VkDescriptorSetLayoutBinding> bindings, uint32_t push_bytes);
  void create_pipeline(std::span<const uint32_t> spirv, std::span<const uint32_t> constants);
  void create_ray_pipeline(std::span<const uint32_t> spirv, const HitShaders& hit_shaders,
                           std::span<const uint32_t> constants);
  void create_shader_table();

  std::shared_ptr<Device> device_;
  VkDescriptorSetLayout set_layout_ = VK_NULL_HANDLE;
  VkDescriptorPool pool_ = VK_NULL_HANDLE;
  VkDescriptorSet set_ = VK_NULL_HANDLE;
  VkPipelineLayout layout_ = VK_NULL_HANDLE;
  VkPipeline pipeline_ = VK_NULL_HANDLE;
  VkShaderStageFlags push_stages_ = VK_SHADER_STAGE_COMPUTE_BIT;
  // Of ray tracing pipelines:
  bool traces_ = false;
  std::unique_ptr<Buffer> shader_table_; ///< ray generation, miss and hit group
  uint64_t table_stride_ = 0;
};

} // namespace packtrace::gpu
