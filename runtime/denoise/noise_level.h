#pragma once

#include <span>

#include "runtime/denoise/guides.h"
#include "runtime/denoise/history.h"

namespace packtrace {

/// Variance of the noise in history.mean as a share of what independent samples would leave: near 1 for white noise,
/// far less for low-discrepancy samplers, whose error falls faster than 1 / sqrt(n). In [1/64, 1]; 1 where there is too
/// little to go by.
///
/// The median, over a sparse set of pairs of horizontal neighbours with at least 8 frames of history, of their squared
/// difference over the sum of their variances, divided by what it is for Gaussian noise. As a median it does not mind
/// that some pairs straddle an edge.
/// @param variance of history.mean by its own moments, one per pixel
float noise_ratio(const Guides& guides, const History& history, std::span<const float> variance);

} // namespace packtrace
