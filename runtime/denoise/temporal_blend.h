#pragma once

#include <span>

#include "runtime/denoise/flux_config.h"
#include "runtime/denoise/guides.h"
#include "runtime/denoise/history.h"
#include "runtime/denoise/local_statistics.h"

namespace packtrace {

/// Adds a frame's samples to the slow and the fast history in place: x += (sample - x) / min(n + 1, longest), where n
/// is the history length and longest is max_tspp for the slow and fast_frames for the fast history. Negative and
/// non-finite samples are ignored, and the pixel keeps its history. Samples above 1 are clamped to 1.
/// @param ao one value per pixel, rows top to bottom
/// @param samples out: the input of the local statistics
void accumulate(std::span<const float> ao, const Guides& guides, const FluxConfig& config, History& history,
                FrameSamples& samples);

/// Corrects the slow history where the fast history shows that the scene has changed.
///
/// The change at a pixel is the mean over its window of the fast minus the slow history. Both histories contain the
/// same spatial edges, so the expected change is 0 while the scene stands still, however much AO varies in space.
/// (Comparing a pixel with its neighbours' mean does not have this property.) Where the change exceeds change_gamma
/// standard errors + change_tolerance, the excess is added to the mean and the sample count is reduced, so that detail
/// recovers within a few frames. A 3 x 3 window is tested in the same way to find changes in areas too small for the
/// wide window; the larger of the two corrections is applied.
void correct_history(const FrameSamples& samples, const Guides& guides, const FluxConfig& config, History& history);

} // namespace packtrace
