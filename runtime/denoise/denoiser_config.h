#pragma once

#include <cstdint>

namespace packtrace {

/// Every knob of AoDenoiser. Values outside the stated range (NaN included) are rejected, never clamped.
struct DenoiserConfig {
  /// Longest history in frames where the image stands still: motion below 1/1000 pixel. [1..65535]
  uint32_t max_tspp = 256;

  /// Longest history in frames of a pixel that moves; resampling it blurs a little every frame. [1..65535]
  uint32_t max_tspp_moving = 33;

  /// Length in frames of the fast history that tells the slow one that the scene has changed. [1..64]
  uint32_t fast_frames = 4;

  /// Side of the window of local mean, variance and change, in pixels. Odd. [3..9]
  uint32_t window = 9;

  /// Standard errors by which the two histories may differ before the slow one is corrected. [0.1..10]
  float change_gamma = 2.0f;

  /// AO by which they may differ on top of that. [0..1]
  float change_tolerance = 0.01f;

  /// History lost per unit of correction: a correction of 1/change_response forgets all but the fast history. [0..100]
  float change_response = 10.0f;

  /// Reprojection accepts a previous sample whose depth differs by less than twice this share of the depth ... [0..1]
  float reprojection_depth = 0.02f;

  /// ... plus twice this many depth derivatives. [0..10]
  float reprojection_slope = 1.0f;

  /// Exponent of saturate(1.1 cos) between the normals of this and the previous frame. Power of two. [1..1024]
  uint32_t reprojection_normal_power = 32;

  /// Reject history that lies on another instance.
  bool reprojection_instance_test = true;

  /// Blur weight: exponent of the cosine between the normals. Power of two. [1..1024]
  uint32_t blur_normal_power = 16;

  /// Blur weight: distance from the tangent plane where the weight reaches zero, as a share of the depth ... [0..1]
  float blur_depth = 0.005f;

  /// ... and in depth derivatives along the offset. [0..10]
  float blur_slope = 0.5f;

  /// Blur weight: mean squared difference of two patches, as a multiple of what noise alone makes of it, from which on
  /// they are not mixed. [1.25..100]
  float blur_limit = 3.2f;

  /// Frames of history below which the measured noise is not trusted to find edges by value. [0..1000]
  float blur_trust_frames = 4.0f;

  /// The blur fades out as history grows: full strength up to blur_fade_begin frames, none from blur_fade_end on.
  /// [0..65535], begin < end.
  uint32_t blur_fade_begin = 64;
  uint32_t blur_fade_end = 256;

  /// The wide blur of freshly seen surfaces fades linearly to nothing at this many frames. [1..65535]
  uint32_t disocclusion_frames = 28;

  /// Throws Error (kUsage), naming the field, if one is out of range.
  void validate() const;
};

} // namespace packtrace
