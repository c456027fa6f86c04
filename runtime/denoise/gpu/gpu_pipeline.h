#pragma once

#include <memory>

#include "runtime/denoise/denoise_pipeline.h"
#include "runtime/denoise/flux_config.h"
#include "runtime/gpu/gpu_config.h"

namespace packtrace {

/// Makes the default denoiser on a GPU, where its history stays (docs/denoiser.md). Its results are those of
/// make_flux_pipeline() but for the device's rounding. Throws Error(kUsage) if the configuration is out of range, and
/// as gpu::Device::open() does.
std::unique_ptr<DenoisePipeline> make_gpu_pipeline(const FluxConfig& config, const GpuConfig& device);

} // namespace packtrace
