#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace packtrace::test {

/// One compute shader on the first Vulkan device that is a CPU, or the first at all. Local size 64 along x; storage
/// buffers of set 0: the inputs at bindings 0, 1, ..., the output behind them.
class VulkanCompute {
public:
  /// Empty where there is no device. Throws std::runtime_error where one is there but does not work.
  static std::unique_ptr<VulkanCompute> create(const std::filesystem::path& spirv, uint32_t buffers);
  ~VulkanCompute();

  /// Runs it for `items` invocations.
  std::vector<std::byte> run(std::span<const std::span<const std::byte>> inputs, size_t output_bytes, uint32_t items);
  const std::string& device() const { return device_; }

private:
  VulkanCompute() = default;
  struct State;
  std::unique_ptr<State> state_;
  std::string device_;
};

} // namespace packtrace::test
