#include "runtime/gpu/device/rounding_probe.h"

#include <algorithm>

#include "runtime/gpu/device/buffer.h"
#include "runtime/gpu/device/kernel.h"
#include "runtime/gpu/shaders/spirv.h"

namespace packtrace::gpu {

void probe_rounding(const std::shared_ptr<Device>& device, DeviceTraits& traits) {
  constexpr uint32_t kGroups = 4096, kCounts = 8;
  const Buffer counts(device, kCounts * sizeof(uint32_t), BufferPlace::kHost, "counts of the probe");
  std::fill_n(counts.as<uint32_t>(), kCounts, 0u);
  constexpr uint32_t kConstants[] = {0u, 0u}; // divided() as it is without kExactFloats
  Kernel kernel(device, spirv::probe(), kConstants, 1, 0);
  kernel.bind(0, counts);
  device->run(kernel, {}, kGroups);
  const uint32_t* wrong = counts.as<uint32_t>();
  traits.fused_floats = wrong[0] == 0 && wrong[1] == 0 && wrong[2] == 0;
  traits.fused_doubles = wrong[3] == 0;
  traits.half_bytes = wrong[4] == 0;
}

} // namespace packtrace::gpu
