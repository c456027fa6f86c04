#pragma once

#include <memory>

#include "runtime/denoise/denoise_pipeline.h"
#include "runtime/denoise/reference/reference_config.h"

namespace packtrace {

/// Makes the reference denoiser. Throws Error (kUsage) if the configuration is out of range.
std::unique_ptr<DenoisePipeline> make_reference_pipeline(const ReferenceConfig& config);

} // namespace packtrace
