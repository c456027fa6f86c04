#pragma once

#include "runtime/denoise/guides.h"

namespace packtrace {

/// Change of disparity per pixel along x and y: the smaller of the backward and the forward difference by magnitude,
/// so that the plane of a surface is not bent at its silhouette. 0 where the pixel or both neighbours missed.
struct DepthDerivatives {
  Plane<float> x, y;

  void resize(ImageSize size) { x.resize(size), y.resize(size); }
  void compute(const Guides& guides);
};

} // namespace packtrace
