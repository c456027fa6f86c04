#pragma once

#include <array>
#include <cstdint>

#include "runtime/denoise/denoiser_config.h"
#include "runtime/denoise/depth_derivatives.h"
#include "runtime/denoise/guides.h"

namespace packtrace {

/// How much the surface of a pixel and that of the pixel `step` further along have in common, for the eight neighbours
/// of a 3 x 3 filter with taps `step` apart: 0 (an edge between them, or outside the image) to 255 (one plane).
/// The weight is the same from both ends, so four directions are stored; it depends on guides only, so it lasts as long
/// as the image stands still.
///   normals: max(0, n_p . n_q) ^ blur_normal_power
///   depth:   max(0, 1 - r / t)^2, r the larger distance of one point from the other's tangent plane in disparity,
///            t = blur_depth |disparity| + blur_slope |derivative . offset|
class EdgeWeights {
public:
  /// Offsets of the stored directions, times step.
  static constexpr std::array<std::array<int, 2>, 4> kDirections = {{{1, 0}, {0, 1}, {1, 1}, {-1, 1}}};

  /// @param step distance of taps in pixels, at most kPlaneBorder
  explicit EdgeWeights(int step) : step_(step) {}

  void resize(ImageSize size);
  void compute(const Guides& guides, const DepthDerivatives& derivatives, const DenoiserConfig& config);

  int step() const { return step_; }

  /// Weight between (x, y) and (x, y) + step * kDirections[direction], also for pixels of the border (0).
  const Plane<uint8_t>& direction(size_t index) const { return weights_[index]; }

private:
  int step_;
  std::array<Plane<uint8_t>, 4> weights_;
};

} // namespace packtrace
