#pragma once

#include <memory>

#include "runtime/gpu/device/device.h"

namespace packtrace::gpu {

/// Runs operations with known results on the device, and sets fused_floats, fused_doubles and half_bytes accordingly.
void probe_rounding(const std::shared_ptr<Device>& device, DeviceTraits& traits);

} // namespace packtrace::gpu
