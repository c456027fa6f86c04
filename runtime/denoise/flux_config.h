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
  uint32_t max_tspp_moving = 33;

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
  /// reprojection_depth * disparity ... [0..1]
  float reprojection_depth = 0.02f;

  /// ... + reprojection_slope * disparity change per pixel. [0..10]
  float reprojection_slope = 1.0f;

  /// Reprojection weight: exponent of saturate(1.1 cos a), where a is the angle between the current and the previous
  /// normal. Power of two. [1..1024]
  uint32_t reprojection_normal_power = 32;

  /// Reject history from another instance.
  bool reprojection_instance_test = true;

  /// Blur weight: exponent of the cosine between the two normals. Power of two. [1..1024]
  uint32_t blur_normal_power = 16;

  /// Blur weight: it falls to zero where a point's distance from the other's tangent plane, in disparity, reaches
  /// blur_depth * disparity ... [0..1]
  float blur_depth = 0.005f;

  /// ... + blur_slope * disparity change along the tap offset. [0..10]
  float blur_slope = 0.5f;

  /// Blur weight: it falls to zero where the mean squared difference of two patches reaches this multiple of the value
  /// expected from noise alone. [1.25..100]
  float blur_limit = 3.2f;

  /// For histories not much longer than this many frames, the estimated noise variance is raised, so that value
  /// differences hardly count as edges. [0..1000]
  float blur_trust_frames = 4.0f;

  /// The blur has full strength up to blur_fade_begin frames of history and fades linearly to zero at blur_fade_end.
  /// [0..65535], begin < end.
  uint32_t blur_fade_begin = 64;
  uint32_t blur_fade_end = 256;

  /// The wide blur of disoccluded surfaces fades linearly to zero at this many frames of history. [1..65535]
  uint32_t disocclusion_frames = 28;

  /// Throws Error (kUsage) naming the first field that is out of range.
  void validate() const;
};

/// The description of all fields.
std::span<const Setting<FluxConfig>> flux_settings();

} // namespace packtrace
