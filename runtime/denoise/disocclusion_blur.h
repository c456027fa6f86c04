#pragma once

#include <span>

#include "runtime/denoise/edge_blur.h"
#include "runtime/denoise/guides.h"

namespace packtrace {

/// Fills hit pixels that have neither history nor a sample. The value is, in this order of preference:
///  - the mean of the sampled neighbours on the same surface, weighted by edge weights, for the smallest tap distance
///    that finds any;
///  - the mean of all sampled pixels within kPlaneBorder pixels;
///  - 1 (unoccluded).
/// The variance is set to 1/4, the maximum for values in [0,1]. Only `image` is filled; the history of these pixels
/// stays empty.
/// @param samples tspp per pixel
void fill_unsampled(const Guides& guides, const Plane<float>& samples, std::span<const EdgeWeights> edges,
                    NoisyImage& image);

/// Blurs surfaces that came into view a few frames ago: one edge_blur pass per entry of `edges`. The strength falls
/// linearly from 1 without history to 0 at `frames` frames of history.
void disocclusion_blur(const Plane<float>& samples, std::span<const EdgeWeights> edges, float frames, float limit,
                       ImageSize size, NoisyImage& image, BlurScratch& scratch);

} // namespace packtrace
