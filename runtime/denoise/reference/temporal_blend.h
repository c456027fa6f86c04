#pragma once

#include <span>

#include "runtime/denoise/reference/buffers.h"
#include "runtime/denoise/reference/reference_config.h"

namespace packtrace::reference {

/// Adds a frame's samples to the reprojected history, in place.
///
/// The history's value is first clamped to the local mean of the samples +- max(gamma sqrt(local variance), clamp_min),
/// where its window holds at least two samples. A pixel without history starts with its sample. Otherwise tspp becomes
/// min(tspp + 1, max_tspp), reduced by the factor 1 - saturate(response |change by the clamp|), but at least 1; and
/// value, mean, square and distance move by a = clamp(1 / tspp, min_blend, 1) towards the sample. A pixel without a
/// sample in this frame keeps its (clamped) history.
/// @param ao one value per pixel; negative and non-finite values are no samples, values above 1 count as 1
/// @param hit_distance world units; values that are not finite and positive leave the mean distance as it is, values
///        above ray_length count as ray_length
/// @param deviation out: standard deviation of the samples, from mean and square if tspp >= variance_frames, else
///        from the window
/// @param mean_variance out: variance of the mean of tspp samples with that deviation; 0 without history
void blend(std::span<const float> ao, std::span<const float> hit_distance, float ray_length, const Surfaces& surfaces,
           const ReferenceConfig& config, History& history, Plane<float>& deviation, std::span<float> mean_variance);

} // namespace packtrace::reference
