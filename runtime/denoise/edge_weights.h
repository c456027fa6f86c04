#pragma once

#include <array>
#include <cstdint>

#include "runtime/denoise/depth_derivatives.h"
#include "runtime/denoise/flux_config.h"
#include "runtime/denoise/guides.h"

namespace packtrace {

/// Edge-stopping weights for a 3 x 3 filter whose taps are `step` pixels apart: 0 (edge between the two pixels, or
/// outside the image) to 255 (both pixels on one plane). The weight is the product of
///   normals: max(0, n_p . n_q) ^ blur_normal_power
///   depth:   max(0, 1 - r / t)^2, where r is the larger of the two distances of one point from the other's tangent
///            plane, in disparity, and t = blur_depth * disparity + blur_slope * |derivative . offset|, each term the
///            smaller of its values at the two pixels.
/// Weights are symmetric, so four of the eight directions are stored. They depend on guides only and stay valid while
/// the image stands still.
class EdgeWeights {
public:
  /// Stored directions (x, y); the tap offset is step times the direction.
  static constexpr std::array<std::array<int, 2>, 4> kDirections = {{{1, 0}, {0, 1}, {1, 1}, {-1, 1}}};

  /// @param step tap distance in pixels, at most kPlaneBorder
  explicit EdgeWeights(int step) : step_(step) {}

  void resize(ImageSize size);
  void compute(const Guides& guides, const DepthDerivatives& derivatives, const FluxConfig& config);

  int step() const { return step_; }

  /// Plane whose entry (x, y) is the weight between (x, y) and (x, y) + step * kDirections[index]. Entries of the
  /// border are 0.
  const Plane<uint8_t>& direction(size_t index) const { return weights_[index]; }

private:
  int step_;
  std::array<Plane<uint8_t>, 4> weights_;
};

} // namespace packtrace
