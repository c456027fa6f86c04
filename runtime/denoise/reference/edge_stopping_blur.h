#pragma once

#include "runtime/denoise/reference/buffers.h"
#include "runtime/denoise/reference/reference_config.h"

namespace packtrace::reference {

/// Facts about a frame that decide the width of the blur.
struct BlurScale {
  float pixel_spread; ///< world-space length of a pixel at view z 1
  float ray_length;   ///< hit distance of a miss, world units
  uint32_t frame;     ///< frames since the history began; the tap distance cycles with it
};

/// One 3 x 3 blur whose tap distance follows the hit distance, so that contact shadows stay sharp. Per axis, a pixel
/// has a footprint w = sqrt((pixel_spread z)^2 + (dz)^2) and a
///   target = clamp(round(kernel_scale r^exponent hit / w), 1, kernel_max_width * image width / 2), r = hit /
///   ray_length,
/// and the taps are 1/cycle, 2/cycle, ... of the target away in the frames of a cycle, at least one pixel.
/// The weight of a tap at `offset` is the product of
///  - a normalised Gaussian;
///  - exp(-|dv| / (value_sigma deviation / |k| + value_floor)), where |k| is 1, or sqrt(2) for diagonal taps;
///  - max(0, n.n_i)^power;
///  - exp(-max(0, |dz| - epsilon) / (depth_sigma change(offset) + epsilon)), 0 below a cutoff, where change() is the
///    change of depth in the pixel's plane, summed over the axes.
/// A pixel without a value takes its direct neighbours', without the weight for values, and their moments.
/// @param blended in: history.value before the blur, written by blend()
/// @param deviation of the samples
/// @param history out: value, the next frame's history; mean and square of the pixels that were filled
void edge_stopping_blur(const Surfaces& surfaces, const Derivatives& derivatives, const Plane<float>& blended,
                        const Plane<float>& deviation, BlurScale scale, const ReferenceConfig& config,
                        History& history);

} // namespace packtrace::reference
