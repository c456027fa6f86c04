#pragma once

#include <span>
#include <vector>

#include "runtime/denoise/flux_config.h"
#include "runtime/denoise/guides.h"
#include "runtime/denoise/history.h"
#include "runtime/denoise/kernels/history_rows.h"

namespace packtrace {

/// The guides of a frame and the history of its pixels.
struct FrameHistory {
  Guides guides;
  History history;
};

/// What is known of the motion from one frame to the next.
struct MotionFrame {
  const FrameHistory& previous;
  const Guides& guides;            ///< of the new frame
  std::span<const Vec2> motion_px; ///< GBuffer::motion_px; pixels with non-finite motion get no history
  /// GBuffer::previous_z; pixels whose previous depth is not positive and finite get no history.
  std::span<const float> previous_z;
};

/// Resamples the previous frame's history at the surface points of the current frame. The history of a pixel is the
/// weighted mean of the 2 x 2 previous pixels around its previous position. Weights are bilinear, times the agreement
/// of depth and normal; previous pixels of another instance have weight 0.
/// Where the neighbourhood lies on one surface, the AO mean is interpolated with bicubic precision along each axis, so
/// that camera pans do not blur it.
/// The sample count is scaled by the sum of the weights, so partial agreement shortens the history.
/// Where that sum is at most kLostWeight, as on edges thinner than a pixel, which camera rays do not meet in every
/// frame, the history is the weighted mean of those of the surface's nearby pixels, at a fraction of their length
/// (FluxConfig::reprojection_nearby).
/// Depth is compared where the surface was: tolerances are those of its disparity in the previous frame, with the
/// change of disparity per pixel scaled in proportion.
///
/// Neighbouring pixels mostly move by the same whole number of pixels; each run of such pixels reads consecutive
/// pixels of the previous frame. Use one object per thread.
class ReprojectionRows {
public:
  ReprojectionRows(ImageSize size, const FluxConfig& config, const HistoryKernels& kernels);

  /// Returns row y of the history, 0 where it is rejected, valid until the next call.
  PastRow at(const MotionFrame& frame, int y);
  /// The sums of the weights of the last row's footprints.
  const float* weights() const { return weights_; }

private:
  const FluxConfig& config_;
  const HistoryKernels& kernels_;
  int width_;
  std::vector<int32_t> offset_;
  std::vector<float> rows_; // of the located and of the resampled pixels
  LocatedRow located_;
  PastRow result_;
  float* weights_; // of rows_, as are those before
};

} // namespace packtrace
