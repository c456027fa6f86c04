#pragma once

#include <array>

#include "runtime/denoise/reference/buffers.h"
#include "runtime/denoise/reference/reference_config.h"

namespace packtrace::reference {

/// Blurs surfaces with a short history, for display only: 3 x 3 Gaussians whose taps are 1, 2 and 4 pixels apart. A tap
/// at kernel offset k counts where |dz| <= (depth + slope step |k|) z. The result is
/// lerp(centre, filtered, 1 - min(tspp, frames) / frames), and the filtered value where a pixel has none.
/// Each pass reads one buffer and writes another.
/// @param tspp history length per pixel
/// @param value in: the blurred history; kInvalidAo: none
/// @param passes scratch
/// @return the result, one of `value` and `passes`
const Plane<float>& disocclusion_blur(const Surfaces& surfaces, const Plane<float>& tspp, const Plane<float>& value,
                                      const ReferenceConfig& config, std::array<Plane<float>, 2>& passes);

} // namespace packtrace::reference
