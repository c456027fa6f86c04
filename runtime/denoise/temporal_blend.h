#pragma once

#include <span>

#include "runtime/denoise/denoiser_config.h"
#include "runtime/denoise/edge_blur.h"
#include "runtime/denoise/guides.h"
#include "runtime/denoise/history.h"
#include "runtime/denoise/local_statistics.h"

namespace packtrace {

/// Adds a frame's samples to the slow and the fast history in place: x += (sample - x) / min(n + 1, longest).
/// Samples that are negative or not finite count as absent, samples above 1 as 1; without one a pixel keeps its
/// history. Also lists what local statistics need.
/// @param ao one value per pixel of the guides' size
void accumulate(std::span<const float> ao, const Guides& guides, const DenoiserConfig& config, History& history,
                FrameSamples& samples);

/// Corrects the slow history where the fast one says that the scene has changed, and estimates the noise.
///
/// The change of a pixel is the mean over its window of fast minus slow history. Both see the same edges in the same
/// window, so unlike the distance of a pixel from its neighbours' mean this is 0 in expectation while nothing
/// changes, however much AO varies in space. Where it exceeds change_gamma standard errors + change_tolerance the
/// excess is added to the mean and the count of samples shrinks, so that detail follows within a few frames. The 3 x 3
/// window does the same for changes too small for the wide window.
///
/// @param value_variance out, one entry per pixel: variance of history.mean, AO squared; the variance of samples is
///        that of the history, held up by the window's while the history is short; 0 without history
/// @param image out: history.mean and the precision for the blurs to reckon with. A few samples are skewed and say
///        little about their variance, so differences between young pixels are no evidence of an edge: their variance
///        is taken (1 + (blur_trust_frames / tspp)^2) times as large.
void correct_history(const FrameSamples& samples, const Guides& guides, const DenoiserConfig& config, History& history,
                     std::span<float> value_variance, NoisyImage& image);

} // namespace packtrace
