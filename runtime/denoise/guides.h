#pragma once

#include <cstdint>

#include "runtime/denoise/kernels/units.h"
#include "runtime/denoise/plane.h"

namespace packtrace {

/// Returns 1 / z, or 0 if no surface may have depth z.
inline float disparity_of(float z) { return z >= kNearestDepth && z <= kFarthestDepth ? 1.0f / z : 0.0f; }

/// The G-buffer channels that the filters use, as planes. A depth that no surface may have is stored as
/// disparity 0, which means a miss. A normal that is not finite, or far from a unit vector, is stored as a zero vector,
/// which gets weight 0 in blurs and in reprojection.
struct Guides {
  ImageSize size;
  /// 1 / view_z, or 0 where the camera ray missed. In a perspective view it is a linear function of pixel coordinates
  /// on every planar surface.
  Plane<float> disparity;
  Plane<int16_t> normal_x, normal_y, normal_z; ///< in kNormalUnit, from -1 to 1
  Plane<uint32_t> instance;

  void resize(ImageSize new_size);
  /// Plane::make_room() of all planes.
  void make_room(ImageSize new_size);
  size_t bytes() const {
    return disparity.bytes() + normal_x.bytes() + normal_y.bytes() + normal_z.bytes() + instance.bytes();
  }

  /// Copies the guides of a G-buffer of the same size.
  void load(const GBuffer& gbuffer);

  /// Returns true if load() would change nothing and no pixel moves by more than kStillMotion.
  bool still_matches(const GBuffer& gbuffer) const;
};

} // namespace packtrace
