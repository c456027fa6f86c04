#pragma once

#include <cstdint>
#include <span>

#include "pbrt_import/base/setting.h"

namespace packtrace {

/// Settings of the default denoiser. Values outside the stated range, including NaN, are rejected and never clamped.
struct FluxConfig {
  /// Maximum history length in frames for still pixels (motion up to 1/1000 pixel). [1..65535]
  uint32_t max_tspp = 256;

  /// Maximum history length in frames for moving pixels, whose history gets slightly blurrier with every frame's
  /// resampling. [1..65535]
  uint32_t max_tspp_moving = 8;

  /// Length in frames of the fast history, which detects that the scene has changed. [1..64]
  uint32_t fast_frames = 4;

  /// Side in pixels of the window for local mean, variance and change. Odd. [3..9]
  uint32_t window = 9;

  /// The slow history is corrected where the window means of the fast and the slow history differ by more than
  /// change_gamma standard errors ... [0.1..10]
  float change_gamma = 2.0f;

  /// ... plus this much AO. [0..1]
  float change_tolerance = 0.01f;

  /// Fraction of the history length lost per unit of corrected AO: a correction of 1 / change_response shortens the
  /// history to fast_frames. [0..100]
  float change_response = 10.0f;

  /// Reprojection rejects history whose disparity (1 / depth) differs by more than twice the tolerance
  /// reprojection_depth * disparity, four times that where GBuffer::previous_z is unknown ... [0..1]
  float reprojection_depth = 0.005f;

  /// ... + reprojection_slope * disparity change per pixel. [0..10]
  float reprojection_slope = 1.0f;

  /// Reprojection weight: exponent of saturate(1.1 cos a), where a is the angle between the current and the previous
  /// normal. Power of two. [1..1024]
  uint32_t reprojection_normal_power = 4;

  /// Reject history from another instance.
  bool reprojection_instance_test = true;

  /// A pixel that has lost its history takes over the mean of those of its surface within 3 pixels, at this fraction of
  /// their length, which counts up to max_tspp_moving. 0: it starts without history. [0..1]
  float reprojection_nearby = 0.35f;

  /// Number of filter passes: the first ones of the steps 1, 2, 4 and 1 pixels. [0..4]
  uint32_t passes = 4;

  /// Guide weight: it falls to its least value where a point's distance from the other's tangent plane, in disparity,
  /// reaches guide_depth * disparity ... [0..1]
  float guide_depth = 0.0016f;

  /// ... + guide_slope * the lesser disparity change along the offset of both pixels ... [0..10]
  float guide_slope = 0.5f;

  /// ... + guide_bend * the difference of these changes, which is twice the distance on an evenly curved surface; at
  /// most five times guide_depth * disparity. [0..10]
  float guide_bend = 1.4f;

  /// Differences of patches count as noise up to this many times its variance. [0.1..100]
  float noise_tolerance = 2.0f;

  /// Mean distance of patches at which pixels exchange nothing. Distances of pixels count up to about 25. [0.1..25]
  float patch_limit = 4.0f;

  /// Weight of the variance around a pixel against its own, in frames. [0.1..1000]
  float variance_prior = 6.0f;

  /// The variance of n frames is multiplied by 1 + variance_distrust / n^2. [0..1000]
  float variance_distrust = 4.0f;

  /// Weight of the average sampler's error against the errors that histories of stratified samples show, in pixels.
  /// [0.01..1000000]
  float ratio_prior = 1.0f;

  /// Throws Error (kUsage) naming the first field that is out of range.
  void validate() const;
};

/// The description of all fields.
std::span<const Setting<FluxConfig>> flux_settings();

} // namespace packtrace
