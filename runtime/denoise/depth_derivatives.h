#pragma once

#include "runtime/denoise/guides.h"

namespace packtrace {

/// Change of disparity per pixel along x and y. Of the backward and the forward difference the one of smaller magnitude
/// is used, so that a step at a silhouette does not tilt the surface's tangent plane. Neighbours that missed are
/// ignored; the derivative is 0 where the pixel or both neighbours missed.
struct DepthDerivatives {
  Plane<float> x, y;

  void resize(ImageSize size) { x.resize(size), y.resize(size); }
  void compute(const Guides& guides);
};

} // namespace packtrace
