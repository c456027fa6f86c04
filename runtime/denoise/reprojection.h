#pragma once

#include <span>

#include "runtime/denoise/depth_derivatives.h"
#include "runtime/denoise/flux_config.h"
#include "runtime/denoise/guides.h"
#include "runtime/denoise/history.h"

namespace packtrace {

/// The guides of a frame and the history of its pixels.
struct FrameHistory {
  Guides guides;
  History history;
};

/// Resamples the previous frame's history at the surface points of the current frame. The history of a pixel is the
/// weighted mean of the 2 x 2 previous pixels around its previous position. Weights are bilinear, times the agreement
/// of depth and normal; previous pixels of another instance have weight 0.
/// Where the neighbourhood lies on one surface, the AO mean is interpolated with bicubic precision along each axis, so
/// that camera pans do not blur it.
/// All pixels of `reprojected` are written: 0 where history is rejected. The sample count is scaled by the sum of the
/// weights, so partial agreement shortens the history.
/// Depth is compared where the surface was: tolerances are those of its disparity in the previous frame, with the
/// change of disparity per pixel scaled in proportion.
/// @param motion_px GBuffer::motion_px; pixels with non-finite motion get no history
/// @param previous_z GBuffer::previous_z; pixels whose previous depth is not positive and finite get no history
void reproject(const FrameHistory& previous, const Guides& guides, const DepthDerivatives& derivatives,
               std::span<const Vec2> motion_px, std::span<const float> previous_z, const FluxConfig& config,
               History& reprojected);

} // namespace packtrace
