#pragma once

#include "runtime/denoise/reference/buffers.h"

namespace packtrace::reference {

/// Of the backward and the forward difference of view z along each axis, keeps the one of smaller magnitude, with its
/// sign, so that silhouettes do not count as slopes. Neighbours that missed are ignored; 0 without a neighbour.
void derive_depth(const Surfaces& surfaces, Derivatives& derivatives);

/// Magnitude of the change of view z at q >= 0 pixels from a pixel with depth z and derivative d:
///   |(z + d) / (1 + (1 - q) d / z) - z|,
/// which is exact for a plane in perspective. Where the plane reaches infinity within q pixels, a huge number.
inline float depth_change(float z, float d, float q) {
  const float scale = z + (1.0f - q) * d;
  const float far = z * (z + d) / (scale > 1e-6f * z ? scale : 1e-6f * z);
  return far > z ? far - z : z - far;
}

} // namespace packtrace::reference
