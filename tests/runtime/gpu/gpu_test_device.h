#pragma once

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "runtime/gpu/device/device.h"
#include "runtime/gpu/gpu_config.h"

namespace packtrace::test {

/// The first usable Vulkan device, a CPU device if there is no other, with validation; an empty name if there is none.
inline GpuConfig any_device() {
  GpuConfig config;
  config.validation = true;
  try {
    for (const std::string& name : gpu::device_names(config))
      if (name.find(" (lacks ") == std::string::npos) {
        config.device = name;
        break;
      }
  } catch (const Error&) { // no loader
  }
  return config;
}

/// Skips tests without a Vulkan device.
class OnGpu : public testing::Test {
protected:
  void SetUp() override {
    if (config_.device.empty()) GTEST_SKIP() << "no Vulkan device with what kernels need: install mesa-vulkan-drivers";
  }

  const GpuConfig config_ = any_device();
};

} // namespace packtrace::test
