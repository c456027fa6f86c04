#include "runtime/view/quality_control.h"

#include <algorithm>

namespace packtrace {
namespace {

constexpr uint32_t kSmallestStep = 4; ///< half the resolution per axis
constexpr double kSlow = 1.1, kFast = 0.7;
constexpr uint32_t kSlowFrames = 2, kFastFrames = 12;

uint32_t eighths(uint32_t side, uint32_t step) { return std::max<uint32_t>(1, side * (8 - step) / 8); }

/// Pixels of a step relative to step 0.
double pixel_fraction(uint32_t step) {
  const double side = (8.0 - std::min(step, kSmallestStep)) / 8.0;
  return side * side;
}

} // namespace

FrameConfig at_quality_step(const FrameConfig& config, uint32_t step) {
  FrameConfig cheaper = config;
  const uint32_t smaller = std::min(step, kSmallestStep);
  cheaper.size = {eighths(config.size.width, smaller), eighths(config.size.height, smaller)};
  if (step == 5 && config.ao_resolution == AoResolution::kFull) cheaper.ao_rate = AoRate::kCheckerboard;
  if (step >= 6) cheaper.ao_resolution = AoResolution::kQuarter, cheaper.ao_rate = AoRate::kFull;
  return cheaper;
}

uint32_t QualityControl::step_down(double frame_ms) const {
  uint32_t step = step_;
  do ++step;
  while (step < kSmallestStep && frame_ms * pixel_fraction(step) / pixel_fraction(step_) > kSlow * target_ms_);
  return step;
}

void QualityControl::start(double still_ms) {
  if (target_ms_ <= 0.0 || has_moved_) return;
  step_ = 0;
  if (still_ms > kSlow * target_ms_) step_ = step_down(still_ms);
}

void QualityControl::add(double frame_ms) {
  if (target_ms_ <= 0.0) return;
  has_moved_ = true;
  slow_ = frame_ms > kSlow * target_ms_ ? slow_ + 1 : 0;
  fast_ = frame_ms < kFast * target_ms_ ? fast_ + 1 : 0;
  if (slow_ >= kSlowFrames && step_ < kCheapestStep) {
    step_ = step_down(frame_ms);
    slow_ = 0;
  } else if (fast_ >= kFastFrames && step_ > 0) {
    --step_;
    fast_ = 0;
  }
}

} // namespace packtrace
