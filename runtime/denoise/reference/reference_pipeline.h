#pragma once

#include <memory>

#include "runtime/denoise/denoise_pipeline.h"
#include "runtime/denoise/reference/reference_config.h"

namespace packtrace {

/// Makes the reference denoiser (docs/denoiser.md): reprojection, accumulation with a neighbourhood clamp, a blur whose
/// output is the history of the next frame, and a blur of disoccluded surfaces. A still view's HistorySource::kPixel
/// takes each pixel's own history without tests. Images have at most 2^30 pixels.
/// Throws Error (kUsage) if the configuration is out of range.
std::unique_ptr<DenoisePipeline> make_reference_pipeline(const ReferenceConfig& config);

} // namespace packtrace
