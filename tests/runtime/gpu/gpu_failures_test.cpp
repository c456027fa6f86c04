// Errors of backend gpu where it cannot work. It never falls back to another backend.

#include <gtest/gtest.h>

#include "runtime/gpu/device/buffer.h"
#include "runtime/gpu/device/device_features.h"
#include "runtime/trace/gpu/gpu_tracer.h"
#include "runtime/trace/make_tracer.h"
#include "runtime/trace/source/float_source.h"
#include "tests/runtime/gpu/gpu_test_device.h"
#include "tests/runtime/trace/packed_scenes.h"

namespace packtrace {
namespace {

Scene small_scene() {
  Scene scene;
  test::add_shape(scene, test::sphere({0, 0, 0}, 1, 8));
  return scene;
}

/// The error of making a tracer: its kind and message; "none" if there is none.
std::pair<ErrorKind, std::string> error_of(const GpuConfig& gpu) {
  const test::BakedScene baked(small_scene());
  TracerConfig config;
  config.backend = Backend::kGpu;
  config.gpu = gpu;
  try {
    make_tracer(baked.source, &baked.file, config);
  } catch (const Error& error) {
    return {error.kind(), error.what()};
  }
  return {ErrorKind::kUsage, "none"};
}

TEST(GpuFailures, NoLoader) {
  GpuConfig config;
  config.loader = "libnot-there.so.1";
  const auto [kind, message] = error_of(config);
  EXPECT_EQ(kind, ErrorKind::kUnsupported);
  EXPECT_EQ(message, "backend gpu: no Vulkan loader (libnot-there.so.1) found; use --backend packed");
}

TEST(GpuFailures, ALibraryThatIsNoLoader) {
  GpuConfig config;
  config.loader = "libm.so.6";
  EXPECT_EQ(error_of(config).second, "backend gpu: no Vulkan loader (libm.so.6) found; use --backend packed");
}

/// Each feature is needed, and named where it is missing.
TEST(GpuFailures, DevicesWithoutTheFeatures) {
  gpu::DeviceFeatures all;
  all.api_version = VK_API_VERSION_1_3, all.int64 = all.float64 = all.computes = true;
  all.subgroups = ~VkSubgroupFeatureFlags{0}, all.storage_buffers = 16;
  EXPECT_EQ(gpu::missing_features(all, GpuStructures::kPacked), "");
  gpu::DeviceFeatures one = all;
  one.float64 = false;
  EXPECT_EQ(gpu::missing_features(one, GpuStructures::kPacked), "shaderFloat64");
  one = all, one.api_version = VK_API_VERSION_1_1, one.int64 = false;
  EXPECT_EQ(gpu::missing_features(one, GpuStructures::kPacked), "Vulkan 1.2, shaderInt64");
  one = all, one.subgroups = all.subgroups & ~VkSubgroupFeatureFlags{VK_SUBGROUP_FEATURE_SHUFFLE_BIT};
  EXPECT_EQ(gpu::missing_features(one, GpuStructures::kPacked), "subgroup ballot, shuffle and arithmetic");
  one = all, one.storage_buffers = 15, one.computes = false;
  EXPECT_EQ(gpu::missing_features(one, GpuStructures::kPacked), "16 storage buffers per kernel, a compute queue");
  EXPECT_EQ(gpu::missing_features(all, GpuStructures::kDriver), "acceleration structures and ray tracing pipelines");
  all.structures = true;
  EXPECT_EQ(gpu::missing_features(all, GpuStructures::kDriver), "");
}

class GpuFailuresOnDevice : public test::OnGpu {};

TEST_F(GpuFailuresOnDevice, NoSuchDevice) {
  GpuConfig config = config_;
  config.device = "Voodoo 2";
  const auto [kind, message] = error_of(config);
  EXPECT_EQ(kind, ErrorKind::kUnsupported);
  EXPECT_EQ(message, "backend gpu: no Vulkan device with \"Voodoo 2\" in its name found; use --backend packed");
}

/// A device that runs on the CPU is used by name only.
TEST_F(GpuFailuresOnDevice, CpuDevicesAreNotChosen) {
  if (!gpu::Device::open(config_)->on_cpu()) GTEST_SKIP() << "there is a GPU";
  GpuConfig config = config_;
  config.device.clear();
  const auto [kind, message] = error_of(config);
  EXPECT_EQ(kind, ErrorKind::kUnsupported);
  EXPECT_NE(message.find("no Vulkan device found that is a GPU"), std::string::npos) << message;
}

TEST_F(GpuFailuresOnDevice, NamesAreFoundInAnyCase) {
  GpuConfig config = config_;
  for (char& c : config.device) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  EXPECT_EQ(error_of(config).second, "none");
}

TEST_F(GpuFailuresOnDevice, OutOfMemory) {
  GpuConfig config = config_;
  config.memory_limit_bytes = 2000;
  const auto [kind, message] = error_of(config);
  EXPECT_EQ(kind, ErrorKind::kLimitExceeded);
  EXPECT_NE(message.find("out of device memory: "), std::string::npos) << message;
  EXPECT_NE(message.find(" bytes; "), std::string::npos) << message;
  EXPECT_NE(message.find(" has 2000, of which "), std::string::npos) << message;
}

TEST_F(GpuFailuresOnDevice, BuffersThatKernelsCannotAddress) {
  const auto device = gpu::Device::open(config_);
  const uint64_t bytes = (uint64_t{device->limits().maxStorageBufferRange} / 16 + 2) * 16;
  try {
    const gpu::Buffer buffer(device, bytes, gpu::BufferPlace::kDevice, "nodes");
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kUnsupported);
    EXPECT_NE(std::string(error.what()).find("nodes need " + std::to_string(bytes)), std::string::npos) << error.what();
  }
}

TEST_F(GpuFailuresOnDevice, FreedMemoryIsCountedBack) {
  const auto device = gpu::Device::open(config_);
  const uint64_t before = device->allocated_bytes();
  {
    const gpu::Buffer buffer(device, 1 << 20, gpu::BufferPlace::kHost, "test");
    EXPECT_GE(device->allocated_bytes(), before + (1 << 20));
  }
  EXPECT_EQ(device->allocated_bytes(), before);
}

TEST(GpuFailures, ScenesThatWereNotBaked) {
  const Scene scene = small_scene();
  const FloatSource source(scene);
  TracerConfig config;
  config.backend = Backend::kGpu;
  try {
    make_tracer(source, nullptr, config);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kUnsupported);
    EXPECT_STREQ(error.what(), "backend gpu traces baked files only; bake the scene, or use embree");
  }
}

} // namespace
} // namespace packtrace
