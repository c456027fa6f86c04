#pragma once

#include <memory>

#include "runtime/denoise/denoise_pipeline.h"
#include "runtime/denoise/flux_config.h"

namespace packtrace {

/// Makes the default denoiser (docs/denoiser.md): the history is accumulated along surface motion and never blurred;
/// a copy of it is smoothed by flows between pairs of pixels, which keep the mean. Throws Error(kUsage) if the
/// configuration is out of range.
std::unique_ptr<DenoisePipeline> make_flux_pipeline(const FluxConfig& config);

} // namespace packtrace
