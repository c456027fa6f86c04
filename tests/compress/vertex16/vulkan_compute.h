#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace packtrace::test {

/// Runs one compute shader on the first Vulkan device that is a CPU, or else on the first device. Local size 64 along
/// x. Storage buffers in set 0: inputs at bindings 0, 1, ..., then the output.
class VulkanCompute {
public:
  /// Returns null if there is no device. Throws std::runtime_error if a device exists but does not work.
  static std::unique_ptr<VulkanCompute> create(const std::filesystem::path& spirv, uint32_t buffers);
  ~VulkanCompute();

  /// Runs the shader for `items` invocations.
  std::vector<std::byte> run(std::span<const std::span<const std::byte>> inputs, size_t output_bytes, uint32_t items);
  const std::string& device() const { return device_; }

private:
  VulkanCompute() = default;
  struct State;
  std::unique_ptr<State> state_;
  std::string device_;
};

} // namespace packtrace::test
