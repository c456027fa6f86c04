#pragma once

#include <cmath>

#include "pbrt_import/scene/bounds.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

/// A uniform power-of-two scale and a translation that bring a box to the size of the unit cube: what lies in the box
/// has coordinates in [-1, 1]. Tracing there keeps products of lengths inside the float range for any scale of scene.
class UnitSpace {
public:
  UnitSpace() = default;

  /// The space of a box. An empty box gives the identity; a box without extent is only translated.
  explicit UnitSpace(const Bounds& bounds) {
    if (bounds.empty()) return;
    const DVec3 half = bounds.extent() * 0.5;
    const double size = std::max(half.x, std::max(half.y, half.z));
    centre_ = bounds.centre();
    if (size > 0.0) scale_ = std::ldexp(1.0, -std::ilogb(size) - 1);
  }

  DVec3 to_unit(DVec3 p) const { return (p - centre_) * scale_; }
  DVec3 from_unit(DVec3 p) const { return p / scale_ + centre_; } // exact division: a power of two

  /// Unit lengths per outer length; a power of two.
  double scale() const { return scale_; }

  DAffine unit_from_outer() const { return uniform(scale_, -centre_ * scale_); }
  DAffine outer_from_unit() const { return uniform(1.0 / scale_, centre_); }

private:
  static DAffine uniform(double scale, DVec3 translation) {
    return DAffine(DVec3(scale, 0, 0), DVec3(0, scale, 0), DVec3(0, 0, scale), translation);
  }

  DVec3 centre_{0.0};
  double scale_ = 1.0;
};

} // namespace packtrace
