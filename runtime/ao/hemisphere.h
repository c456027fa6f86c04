#pragma once

#include <cmath>

#include "pbrt_import/scene/math.h"
#include "runtime/simd.h"

namespace packtrace {

/// Maps a point of the unit square to a unit vector about +z. Uniform points give cosine-weighted directions on the
/// hemisphere.
/// Source: Shirley, Chiu, "A low distortion map between disk and square" (1997), and Malley's projection.
inline Vec3 cosine_direction(Vec2 point) {
  constexpr float kQuarterPi = 0.785398163f;
  const float a = 2.0f * point.x - 1.0f, b = 2.0f * point.y - 1.0f;
  const bool wide = std::abs(a) > std::abs(b);
  const float radius = wide ? a : b;
  const float angle = kQuarterPi * (wide ? b : a) / (radius != 0.0f ? radius : 1.0f); // in [-pi/4, pi/4]
  // Taylor polynomials: the error is below 4e-7 on this range, and the bits do not depend on the C library.
  const float s = angle * angle;
  const float sine = angle * (1.0f + s * (-1.0f / 6 + s * (1.0f / 120 + s * (-1.0f / 5040))));
  const float cosine = 1.0f + s * (-0.5f + s * (1.0f / 24 + s * (-1.0f / 720 + s * (1.0f / 40320))));
  const float z = std::sqrt(larger(0.0f, 1.0f - radius * radius));
  return {radius * (wide ? cosine : sine), radius * (wide ? sine : cosine), z};
}

/// Turns a vector about +z into one about the unit vector n.
/// Source: Duff et al., "Building an orthonormal basis, revisited" (2017). The paper switches formulas at z = 0; this
/// version switches at z = -0.4. Vertical walls have z = +0, -0 or a rounding error, so a switch at 0 would rotate
/// their sample pattern from pixel to pixel.
inline Vec3 turned_to(Vec3 n, Vec3 local) {
  constexpr float kSwitch = -0.4f; // keeps |sign + z| >= 0.6
  const float sign = n.z < kSwitch ? -1.0f : 1.0f;
  const float a = -1.0f / (sign + n.z), b = n.x * n.y * a;
  const Vec3 tangent(1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x);
  const Vec3 bitangent(b, sign + n.y * n.y * a, -n.y);
  return tangent * local.x + bitangent * local.y + n * local.z;
}

} // namespace packtrace
