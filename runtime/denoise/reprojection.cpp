#include "runtime/denoise/reprojection.h"

#include <bit>
#include <utility>

#include "runtime/denoise/flux_terms.h"
namespace packtrace {
ReprojectionRows::ReprojectionRows(ImageSize size, const FluxConfig& config, const HistoryKernels& kernels)
    : config_(config), kernels_(kernels), width_(static_cast<int>(size.width)) {
  const size_t padded = static_cast<size_t>(size.width) + kRunPadding;
  offset_.resize(padded);
  rows_.resize(10 * padded);
  float* next = rows_.data();
  const auto row = [&] { return std::exchange(next, next + padded); };
  located_ = {offset_.data(), row(), row(), row(), row(), row()};
  result_ = {row(), row(), row(), row()};
  weights_ = row();
}

HistoryRow ReprojectionRows::at(const MotionFrame& frame, int y) {
  const Guides &now = frame.guides, &then = frame.previous.guides;
  const History& history = frame.previous.history;
  const size_t begin = static_cast<size_t>(y) * static_cast<size_t>(width_);
  const LocateTerms terms{located_depth(config_, !frame.previous_z.empty()),
                          config_.reprojection_slope,
                          static_cast<float>(y),
                          static_cast<float>(width_),
                          static_cast<float>(now.size.height),
                          history.mean.stride(),
                          static_cast<float>(config_.max_tspp),
                          longest_moving(config_)};
  const float* previous_z = frame.previous_z.empty() ? nullptr : &frame.previous_z[begin];
  kernels_.locate(
      width_,
      {now.disparity.row(y - 1), now.disparity.row(y), now.disparity.row(y + 1), &frame.motion_px[begin].x, previous_z},
      terms, located_);
  const auto resample = kernels_.resample[static_cast<size_t>(std::countr_zero(config_.reprojection_normal_power))];
  for (int x = 0; x < width_;) {
    int32_t offset = kNoOffset;
    int end = x;
    for (; end < width_; ++end) { // pixels without history belong to any run
      if (offset_[static_cast<size_t>(end)] == offset || offset_[static_cast<size_t>(end)] == kNoOffset) continue;
      if (offset != kNoOffset) break;
      offset = offset_[static_cast<size_t>(end)];
    }
    const ptrdiff_t at = offset == kNoOffset ? 0 : ptrdiff_t{offset} + x;
    const PreviousPixels from{then.disparity.row(y) + at, then.normal_x.row(y) + at, then.normal_y.row(y) + at,
                              then.normal_z.row(y) + at,  then.instance.row(y) + at, history.mean.row(y) + at,
                              history.square.row(y) + at, history.fast.row(y) + at,  history.samples.row(y) + at,
                              history.mean.stride()};
    const LocatedRow& l = located_;
    const WantedRow wanted{
        {l.offset + x, l.fraction_x + x, l.fraction_y + x, l.disparity + x, l.tolerance + x, l.longest + x},
        now.normal_x.row(y) + x,
        now.normal_y.row(y) + x,
        now.normal_z.row(y) + x,
        now.instance.row(y) + x};
    resample(end - x, from, wanted, config_.reprojection_instance_test,
             {result_.mean + x, result_.square + x, result_.fast + x, result_.samples + x}, weights_ + x);
    x = end;
  }
  return result_;
}

} // namespace packtrace
