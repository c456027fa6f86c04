#include "runtime/denoise/reprojection.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "runtime/denoise/flux_terms.h"

namespace packtrace {
namespace {

/// A surface point without history: its disparity in the previous frame and what must match there.
struct LostSurface {
  float disparity, tolerance;
  int nx, ny, nz;
  uint32_t instance;
};

/// Weight of a pixel of the previous frame: 0 if it shows another surface, at most 1.
float agreement(const Guides& guides, int y, ptrdiff_t at, const LostSurface& lost, const FluxConfig& config) {
  const float there = guides.disparity.row(y)[at], distance = std::abs(there - lost.disparity);
  if (!(there > 0.0f) || !(distance <= 2.0f * lost.tolerance)) return 0.0f;
  if (config.reprojection_instance_test && guides.instance.row(y)[at] != lost.instance) return 0.0f;
  const int dot = guides.normal_x.row(y)[at] * lost.nx + guides.normal_y.row(y)[at] * lost.ny +
                  guides.normal_z.row(y)[at] * lost.nz;
  float cosine = std::clamp(1.1f * (kNormalUnit * kNormalUnit) * static_cast<float>(dot), 0.0f, 1.0f);
  for (uint32_t power = config.reprojection_normal_power; power > 1; power /= 2) cosine *= cosine;
  return lost.tolerance / std::max(distance, lost.tolerance) * cosine;
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
    const PreviousPixels from{then.disparity.row(y) + at,  then.normal_x.row(y) + at,  then.normal_y.row(y) + at,
                              then.normal_z.row(y) + at,   then.instance.row(y) + at,  history.mean.row(y) + at,
                              history.samples.row(y) + at, history.square.row(y) + at, history.fast.row(y) + at,
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
  if (config_.reprojection_nearby > 0.0f) look_nearby(frame, y);
  return result_;
}

/// Replaces lost histories of row y by those nearby.
void ReprojectionRows::look_nearby(const MotionFrame& frame, int y) {
  const Guides &now = frame.guides, &then = frame.previous.guides;
  const History& h = frame.previous.history;
  const auto next = [&](int x) { return kernels_.next_lost(x, width_, weights_, located_.disparity); };
  for (int x = next(0); x < width_; x = next(x + 1)) {
    const LostSurface lost{located_.disparity[x],  located_.tolerance[x],  now.normal_x.row(y)[x],
                           now.normal_y.row(y)[x], now.normal_z.row(y)[x], now.instance.row(y)[x]};
    // The square is centred at the footprint's nearest pixel. It stays within the borders of the planes.
    const float fx = located_.fraction_x[x], fy = located_.fraction_y[x];
    const int right = fx >= 0.5f ? 1 : 0, down = fy >= 0.5f ? 1 : 0;
    const ptrdiff_t corner = ptrdiff_t{located_.offset[x]} + x;
    float weight = 0.0f, mean = 0.0f, square = 0.0f, fast = 0.0f, samples = 0.0f;
    for (int dy = down - kNearbyRadius; dy <= down + kNearbyRadius; ++dy)
      for (int dx = right - kNearbyRadius; dx <= right + kNearbyRadius; ++dx) {
        const ptrdiff_t at = corner + dy * h.mean.stride() + dx;
        const float away_x = static_cast<float>(dx) - fx, away_y = static_cast<float>(dy) - fy;
        const float near = 1.0f - (away_x * away_x + away_y * away_y) * (1.0f / (kNearbyReach * kNearbyReach));
        const float count = h.samples.row(y)[at];
        if (!(near > 0.0f) || !(count > 0.0f)) continue;
        const float part = near * near * agreement(then, y, at, lost, config_);
        weight += part, mean += part * h.mean.row(y)[at], samples += part * count;
        square += part * static_cast<float>(h.square.row(y)[at]), fast += part * static_cast<float>(h.fast.row(y)[at]);
      }
    if (!(weight > kMinHistoryWeight)) continue;
    const float scale = 1.0f / weight;
    result_.mean[x] = std::min(mean * scale, 1.0f);
    result_.square[x] = square * scale * (1.0f / kMomentUnits), result_.fast[x] = fast * scale * (1.0f / kMomentUnits);
    result_.samples[x] = config_.reprojection_nearby * std::min(samples * scale, longest_moving(config_));
  }
}

} // namespace packtrace
