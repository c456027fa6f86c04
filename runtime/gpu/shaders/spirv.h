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
std::span<const uint32_t> view();
std::span<const uint32_t> copy();
std::span<const uint32_t> surfaces();
std::span<const uint32_t> picture_points();
std::span<const uint32_t> surface_points();
std::span<const uint32_t> occlusion_rays();
std::span<const uint32_t> occlusion_image();
/// A thread walks its rays alone.
std::span<const uint32_t> occlusion_nearest();
std::span<const uint32_t> occlusion_count();
/// For scenes without masks.
std::span<const uint32_t> occlusion_queue();
std::span<const uint32_t> nearest_queue();
/// For devices with DeviceTraits::partitioned.
std::span<const uint32_t> occlusion_queue_partitioned();
std::span<const uint32_t> nearest_queue_partitioned();

/// Writes the triangles that acceleration structures are built from.
std::span<const uint32_t> decode_triangles();

/// Ray generation shaders of ray tracing pipelines, and the shaders that they share.
std::span<const uint32_t> trace_any_rays();
std::span<const uint32_t> trace_closest_rays();
std::span<const uint32_t> camera_rays();
std::span<const uint32_t> view_rays();
std::span<const uint32_t> occlusion_nearest_rays();
std::span<const uint32_t> occlusion_count_rays();
std::span<const uint32_t> closest_hit();
std::span<const uint32_t> any_hit();
std::span<const uint32_t> miss();

std::span<const uint32_t> denoise_compare();
std::span<const uint32_t> denoise_history();
std::span<const uint32_t> denoise_correct();
std::span<const uint32_t> denoise_guides();
std::span<const uint32_t> denoise_variance();
std::span<const uint32_t> denoise_finish();
std::span<const uint32_t> denoise_pass_first();
std::span<const uint32_t> denoise_pass_1();
std::span<const uint32_t> denoise_pass_2();
std::span<const uint32_t> denoise_pass_4();

} // namespace packtrace::gpu::spirv
