#pragma once

#include <span>

#include "runtime/denoise/reference/buffers.h"
#include "runtime/denoise/reference/reference_config.h"

namespace packtrace::reference {

/// Resamples the previous frame's history at the surface points of this frame. A pixel's history is the weighted mean
/// of the 2 x 2 previous pixels around its previous position. Each weight is the product of
///  - the bilinear weight, 0 outside the image, at misses and where there is no history;
///  - saturate(normal_slack n.n_i)^power, where n_i is the previous pixel's normal;
///  - min(tolerance / (|z - z_i| + epsilon), 1), 0 below a cutoff, with the tolerance sigma (|dz/dx| + |dz/dy|) +
///    epsilon. z is GBuffer::previous_z.
/// History is rejected where the weights' sum is too small; all planes of `reprojected` are then reset. tspp is the sum
/// of weights times max(1, tspp), so that partial agreement shortens the history.
/// @param previous_z may be empty: the same as the current depth
void reproject(const Frame& previous, const Surfaces& surfaces, const Derivatives& derivatives,
               std::span<const Vec2> motion_px, std::span<const float> previous_z, const ReferenceConfig& config,
               History& reprojected);

} // namespace packtrace::reference
