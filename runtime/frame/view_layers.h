#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "runtime/camera/gbuffer.h"
#include "runtime/denoise/denoise_pipeline.h"
#include "runtime/frame/frame_config.h"
#include "runtime/frame/rendered_image.h"

namespace packtrace {

/// Layers that FrameConfig::view_layers fills; those of the denoiser need one.
inline constexpr std::array kTracedViews{"hit_distance", "motion", "previous_depth", "local_variance"};
inline constexpr std::array kDenoiserViews{"variance", "history", "disocclusion"};

/// Intermediate results of tracing and denoising as layers of an image, for FrameConfig::view_layers.
class ViewLayers {
public:
  /// Discards the motion, because nothing has moved since the last image.
  void clear() { motion_px_.clear(), previous_z_.clear(), moved_hits_.clear(); }

  /// Keeps the motion of a frame before which something moved.
  void keep_motion(const GBuffer& gbuffer);

  /// Writes the layers of the last frame into an image: means over the sub-pixels that hit.
  /// @param gbuffer camera rays, of config.traced_size()
  /// @param raw, denoised of the same size, or of half of it (AoResolution::kQuarter); denoised is null without
  /// denoiser
  /// @param frames number of frames since something moved, with the first
  void resolve(const FrameConfig& config, const GBuffer& gbuffer, const AoFrame& raw, const DenoisedAo* denoised,
               uint32_t frames, RenderedImage& image) const;

private:
  std::vector<Vec2> motion_px_; ///< empty: nothing moved
  std::vector<float> previous_z_;
  std::vector<uint8_t> moved_hits_; ///< where the camera rays of that frame hit
};

/// Unbiased variance of the samples in the 7 x 7 pixels around each pixel; 0 for fewer than two samples, and where the
/// pixel has none.
std::vector<float> local_variance(const AoFrame& frame);

} // namespace packtrace
