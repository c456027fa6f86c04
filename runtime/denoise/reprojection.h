#pragma once

#include <span>

#include "runtime/denoise/denoiser_config.h"
#include "runtime/denoise/depth_derivatives.h"
#include "runtime/denoise/guides.h"
#include "runtime/denoise/history.h"

namespace packtrace {

/// One frame's surfaces and the history that belongs to them.
struct FrameHistory {
  Guides guides;
  History history;
};

/// Fetches for every pixel of `guides` the history of the surface point it shows: the mean of the 2 x 2 previous pixels
/// around it, each weighted bilinearly, by how well depth and normal agree, and by whether the instance is the same.
/// The mean is interpolated by cubics where the surface goes on all around, so that pans do not blur it.
/// Pixels whose history is rejected are written too, with zeros. The count of samples shrinks with the weight found.
/// @param motion_px GBuffer::motion_px; not finite means no history
void reproject(const FrameHistory& previous, const Guides& guides, const DepthDerivatives& derivatives,
               std::span<const Vec2> motion_px, const DenoiserConfig& config, History& reprojected);

} // namespace packtrace
