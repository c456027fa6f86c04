#pragma once

#include <span>

#include "runtime/denoise/edge_blur.h"
#include "runtime/denoise/guides.h"

namespace packtrace {

/// Gives pixels of `guides` that have neither history nor a sample the mean of the sampled neighbours on the same
/// surface (by the edge weights, nearest first), else that of whatever lies within kPlaneBorder pixels, else 1 (open).
/// Only the image is filled: in the history these pixels stay unsampled. Their variance becomes 1/4, the largest that
/// values in [0,1] can have.
void fill_unsampled(const Guides& guides, const Plane<float>& samples, std::span<const EdgeWeights> edges,
                    NoisyImage& image);

/// The passes for surfaces that came into view a few frames ago: one edge_blur for each entry of `edges`, of a strength
/// that falls from 1 to 0 at `frames` frames of history.
void disocclusion_blur(const Plane<float>& samples, std::span<const EdgeWeights> edges, float frames, float limit,
                       ImageSize size, NoisyImage& image, BlurScratch& scratch);

} // namespace packtrace
