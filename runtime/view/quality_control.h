#pragma once

#include <cstdint>

#include "runtime/frame/frame_config.h"

namespace packtrace {

/// Quality steps of the frames of a moving view, each cheaper than the one before: the resolution falls by eighths per
/// axis to a half, then occlusion is traced for every other pixel, then for one of 2 x 2.
inline constexpr uint32_t kCheapestStep = 6;

/// The settings of a frame at a step; step 0 changes nothing. Sides are at least 1 pixel.
FrameConfig at_quality_step(const FrameConfig& config, uint32_t step);

/// Chooses the step from the times of previous frames, towards a target time. Two consecutive frames above 1.1 times
/// the target lower the quality by a step, or by several if one cannot suffice; 12 consecutive frames below 0.7 times
/// the target raise it by a step. A step discards the history, so steps are rare.
class QualityControl {
public:
  /// @param target_ms positive; 0: always step 0
  explicit QualityControl(double target_ms = 0.0) : target_ms_(target_ms) {}

  uint32_t step() const { return step_; }
  double target_ms() const { return target_ms_; }
  /// Chooses the step of the first moving frame by the time of a still frame with camera rays at step 0. Has no effect
  /// after add().
  void start(double still_ms);
  /// Adds the time of a moving frame at step().
  void add(double frame_ms);

private:
  /// The next step below step(), at which a frame took this long, whose resolution should meet the target.
  uint32_t step_down(double frame_ms) const;

  double target_ms_;
  bool has_moved_ = false;                  ///< add() was called
  uint32_t step_ = 0, slow_ = 0, fast_ = 0; ///< consecutive frames above and below the target
};

} // namespace packtrace
