#pragma once

#include <cstdint>
#include <span>

#include "pbrt_import/base/setting.h"

namespace packtrace {

/// Settings of the reference denoiser, in the order of its passes. reference_settings() has the ranges.
struct ReferenceConfig {
  /// World-space length of a pixel at view z 1. 0: GBuffer::pixel_spread, or if that is unknown, the spread of a camera
  /// with a field of view of 45 degrees.
  float pixel_spread = 0.0f;
  /// Length of occlusion rays, world units. 0: AoFrame::ray_length, or 22 if that is unknown.
  float ray_length = 0.0f;
  /// Tolerance of depths, as a fraction of the power of two below the depth: depths were meant to be half floats.
  float depth_epsilon = 1.0f / 1024.0f;

  /// Reprojection tolerates differences of depth up to this multiple of the change of depth per pixel ...
  float reprojection_depth_sigma = 1.0f;
  /// ... and rejects pixels whose weight for depth is below this.
  float reprojection_depth_cutoff = 0.5f;
  /// Factor of the cosine between the current and the previous normal, which is then limited to 1.
  float reprojection_normal_slack = 1.1f;
  uint32_t reprojection_normal_power = 32; ///< exponent of that cosine; power of two
  float reprojection_min_weight = 1e-3f;   ///< history with a smaller sum of weights is rejected

  uint32_t window = 9; ///< side in pixels of the box for local mean and variance; odd

  uint32_t max_tspp = 33;         ///< maximum length of the history in frames
  float min_blend = 1.0f / 33.0f; ///< least weight of a new sample
  /// History is clamped to the local mean +- clamp_gamma standard deviations, or clamp_min if that is more.
  float clamp_gamma = 0.6f;
  float clamp_min = 0.05f;
  float clamp_response = 4.0f;  ///< fraction of tspp lost per unit of AO that the clamp changed
  uint32_t variance_frames = 4; ///< shorter histories take the variance of their window

  /// Taps of the blur are kernel_scale r^kernel_exponent times the hit distance away, r = hit distance / ray length ...
  float kernel_scale = 0.02f;
  uint32_t kernel_exponent = 2;
  float kernel_max_width = 0.015f; ///< ... and at most half this fraction of the image's width
  uint32_t kernel_cycle = 3;       ///< frames in which the tap distance grows to that
  float blur_value_sigma = 1.0f;   ///< tolerance of values in standard deviations of the samples ...
  float blur_value_floor = 0.005f; ///< ... plus this much AO
  uint32_t blur_normal_power = 64; ///< exponent of the cosine between two normals; power of two
  float blur_depth_sigma = 1.0f;   ///< tolerance of depths in units of the change of depth in the pixel's plane
  float blur_depth_cutoff = 0.2f;  ///< taps whose weight for depth is below this are ignored

  uint32_t disocclusion_frames = 12; ///< frames of history in which the disocclusion blur fades
  uint32_t disocclusion_passes = 3;  ///< number of its passes, whose taps are 1, 2, 4, ... pixels away
  float disocclusion_depth = 0.05f;  ///< it tolerates relative differences of depth up to this ...
  float disocclusion_slope = 0.001f; ///< ... plus this per pixel of tap distance

  /// Throws Error(kUsage) naming the first field that is out of range.
  void validate() const;
};

/// The description of all fields.
std::span<const Setting<ReferenceConfig>> reference_settings();

} // namespace packtrace
