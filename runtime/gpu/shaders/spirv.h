#pragma once

#include <cstdint>
#include <span>

/// The kernels as SPIR-V, compiled from this folder and validated when packtrace was built.
namespace packtrace::gpu::spirv {

std::span<const uint32_t> probe();
std::span<const uint32_t> trace_any();
std::span<const uint32_t> trace_closest();

} // namespace packtrace::gpu::spirv
