#pragma once

#include <cstdint>
#include <span>

/// The kernels as SPIR-V, compiled from this folder and validated when packtrace was built.
namespace packtrace::gpu::spirv {

std::span<const uint32_t> probe();
std::span<const uint32_t> trace_any();
std::span<const uint32_t> trace_closest();
std::span<const uint32_t> prepare();
std::span<const uint32_t> camera();
std::span<const uint32_t> surface_points();
std::span<const uint32_t> occlusion_rays();
std::span<const uint32_t> occlusion_nearest();
std::span<const uint32_t> occlusion_queue();
/// For devices with DeviceTraits::partitioned.
std::span<const uint32_t> occlusion_queue_partitioned();

} // namespace packtrace::gpu::spirv
