#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "runtime/gpu/device/device.h"

namespace packtrace::gpu {

class Buffer;

/// A compute pipeline and the buffers that it reads and writes.
class Kernel {
public:
  /// @param spirv module that was validated at build time
  /// @param constants values of the specialization constants 0, 1, ...
  /// @param bindings number of storage buffers, bound to 0, 1, ...
  Kernel(std::shared_ptr<Device> device, std::span<const uint32_t> spirv, std::span<const uint32_t> constants,
         uint32_t bindings, uint32_t push_bytes);
  ~Kernel();
  Kernel(const Kernel&) = delete;
  Kernel& operator=(const Kernel&) = delete;

  /// Binds a buffer, which must outlive the runs of this kernel.
  void bind(uint32_t binding, const Buffer& buffer);

private:
  friend class Device;

  explicit Kernel(std::shared_ptr<Device> device);
  void create_layout(uint32_t bindings, uint32_t push_bytes);
  void create_pipeline(std::span<const uint32_t> spirv, std::span<const uint32_t> constants);

  std::shared_ptr<Device> device_;
  VkDescriptorSetLayout set_layout_ = VK_NULL_HANDLE;
  VkDescriptorPool pool_ = VK_NULL_HANDLE;
  VkDescriptorSet set_ = VK_NULL_HANDLE;
  VkPipelineLayout layout_ = VK_NULL_HANDLE;
  VkPipeline pipeline_ = VK_NULL_HANDLE;
};

} // namespace packtrace::gpu
