#pragma once

#include <cstdint>

#include "runtime/camera/gbuffer.h"
#include "runtime/denoise/denoiser.h"

namespace packtrace {

/// Number of pixels with a surface.
uint64_t count_hits(const GBuffer& gbuffer);

/// Mean of DenoisedAo::tspp over the pixels that have AO; 0 if none has. The same for any number of threads.
double mean_history(const DenoisedAo& denoised);

} // namespace packtrace
