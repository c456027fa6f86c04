#pragma once

#include <algorithm>
#include <cmath>

#include "pbrt_import/scene/bounds.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

/// A uniform power-of-two scale, and a translation where it is exact, that map a box into [-kHalfSize, kHalfSize] on
/// every axis. Tracing in this space keeps products of three lengths within the float range for any scale of scene, and
/// for objects of 1e-18 of its size; kHalfSize is large because floats underflow to zero without notice. Both maps are
/// exact for float coordinates: a box is translated along an axis only if no coordinate in it is more than twice
/// another, so that subtracting its centre is exact (Sterbenz' lemma). Translating a box that contains the origin would
/// round away small objects near the origin of a large scene.
class UnitSpace {
public:
  static constexpr double kHalfSize = 0x1p20;

  UnitSpace() = default;

  /// Chooses the space of a box. An empty box gives the identity; a box without extent away from the origin is only
  /// translated.
  explicit UnitSpace(const Bounds& bounds) {
    if (bounds.empty()) return;
    double size = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
      const double lo = bounds.lo[axis], hi = bounds.hi[axis];
      const bool free = (lo > 0.0 && hi <= 2.0 * lo) || (hi < 0.0 && lo >= 2.0 * hi);
      if (free) centre_[axis] = static_cast<double>(static_cast<float>(bounds.centre()[axis]));
      size = std::max({size, std::abs(lo - centre_[axis]), std::abs(hi - centre_[axis])});
    }
    if (size > 0.0) scale_ = std::ldexp(kHalfSize, -std::ilogb(size) - 1), inverse_scale_ = 1.0 / scale_;
  }

  DVec3 to_unit(DVec3 p) const { return (p - centre_) * scale_; }
  DVec3 from_unit(DVec3 p) const { return p * inverse_scale_ + centre_; } // The scale is exact: a power of two.

  /// Outer coordinates of the origin.
  DVec3 centre() const { return centre_; }
  /// Unit-space lengths per outer length; a power of two.
  double scale() const { return scale_; }
  /// Outer lengths per unit-space length.
  double inverse_scale() const { return inverse_scale_; }

  /// Rays that start within this distance of the unit space's origin are traced from there, others from about it; the
  /// corners of the scene's box lie within sqrt(3) kHalfSize.
  static constexpr double kNear = 4.0 * kHalfSize;

  bool operator==(const UnitSpace&) const = default;

  DAffine unit_from_outer() const { return uniform(scale_, -centre_ * scale_); }
  DAffine outer_from_unit() const { return uniform(1.0 / scale_, centre_); }

private:
  static DAffine uniform(double scale, DVec3 translation) {
    return DAffine(DVec3(scale, 0, 0), DVec3(0, scale, 0), DVec3(0, 0, scale), translation);
  }

  DVec3 centre_{0.0};
  double scale_ = 1.0;
  double inverse_scale_ = 1.0;
};

} // namespace packtrace
