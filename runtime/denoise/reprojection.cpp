#include "runtime/denoise/reprojection.h"

#include <bit>
#include <utility>

#include "runtime/denoise/flux_terms.h"

namespace packtrace {
namespace {

/// The previous frame at the beginning of row y.
PreviousPixels row_of(const FrameHistory& frame, int y) {
  const Guides& g = frame.guides;
  const History& h = frame.history;
  return {g.disparity.row(y), g.normal_x.row(y), g.normal_y.row(y), g.normal_z.row(y), g.instance.row(y),
          h.mean.row(y),      h.samples.row(y),  h.square.row(y),   h.fast.row(y),     h.mean.stride()};
}

PreviousPixels shifted(const PreviousPixels& p, ptrdiff_t by) {
  return {p.disparity + by, p.normal_x + by, p.normal_y + by, p.normal_z + by, p.instance + by,
          p.mean + by,      p.samples + by,  p.square + by,   p.fast + by,     p.stride};
}

WantedRow shifted(const WantedRow& w, int by) {
  const LocatedRow& at = w.at;
  return {
      {at.offset + by, at.fraction_x + by, at.fraction_y + by, at.disparity + by, at.tolerance + by, at.longest + by},
      w.normal_x + by,
      w.normal_y + by,
      w.normal_z + by,
      w.instance + by};
}

} // namespace

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

PastRow ReprojectionRows::at(const MotionFrame& frame, int y) {
  const Guides& now = frame.guides;
  const PreviousPixels previous = row_of(frame.previous, y);
  const size_t begin = static_cast<size_t>(y) * static_cast<size_t>(width_);
  const LocateTerms terms{located_depth(config_, !frame.previous_z.empty()),
                          config_.reprojection_slope,
                          static_cast<float>(y),
                          static_cast<float>(width_),
                          static_cast<float>(now.size.height),
                          previous.stride,
                          static_cast<float>(config_.max_tspp),
                          longest_moving(config_)};
  const float* previous_z = frame.previous_z.empty() ? nullptr : &frame.previous_z[begin];
  kernels_.locate(
      width_,
      {now.disparity.row(y - 1), now.disparity.row(y), now.disparity.row(y + 1), &frame.motion_px[begin].x, previous_z},
      terms, located_);
  const auto squarings = static_cast<size_t>(std::countr_zero(config_.reprojection_normal_power));
  const WantedRow wanted{located_, now.normal_x.row(y), now.normal_y.row(y), now.normal_z.row(y), now.instance.row(y)};
  const bool test_instances = config_.reprojection_instance_test;
  for (int x = 0; x < width_;) {
    const Run run = kernels_.next_run(x, width_, offset_.data());
    kernels_.resample[squarings](
        run.end - x, shifted(previous, x + (run.offset == kNoOffset ? 0 : run.offset)), shifted(wanted, x),
        test_instances, {result_.mean + x, result_.square + x, result_.fast + x, result_.samples + x}, weights_ + x);
    x = run.end;
  }
  if (!(config_.reprojection_nearby > 0.0f)) return result_;
  const NearbyTerms terms_nearby{config_.reprojection_nearby, longest_moving(config_)};
  const auto next = [&](int x) { return kernels_.next_lost(x, width_, weights_, located_.disparity); };
  for (int x = next(0); x < width_; x = next(x + 1))
    kernels_.look_nearby[squarings](x, shifted(previous, located_.offset[x]), wanted, test_instances, terms_nearby,
                                    result_);
  return result_;
}

} // namespace packtrace
