#pragma once

#include "runtime/denoise/plane.h"

namespace packtrace {

/// Motion below this many pixels counts as none: it moves the longest default history by a quarter of a pixel.
inline constexpr float kStillMotion = 1e-3f;

/// What the filters need of a G-buffer, as planes. Damaged pixels (depth or normal not finite, depth not positive) are
/// made harmless: no depth means a miss, a zero normal means no neighbour and no history.
struct Guides {
  ImageSize size;
  /// 1 / view_z, 0 where the camera ray missed. Linear over the image on every plane seen in perspective.
  Plane<float> disparity;
  Plane<float> normal_x, normal_y, normal_z;
  Plane<uint32_t> instance;

  void resize(ImageSize new_size);

  /// Overwrites all pixels.
  void load(const GBuffer& gbuffer);

  /// True if load() would change nothing and nothing moves.
  bool still_matches(const GBuffer& gbuffer) const;
};

} // namespace packtrace
