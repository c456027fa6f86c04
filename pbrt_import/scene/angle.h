#pragma once

#include <algorithm>
#include <cmath>

#include "pbrt_import/scene/math.h"

namespace packtrace {

inline constexpr double kDegreesPerRadian = 57.295779513082320877;

/// Angle between two unit vectors in degrees.
inline double angle_degrees(DVec3 a, DVec3 b) {
  return 2.0 * std::asin(std::min(0.5 * glm::length(a - b), 1.0)) * kDegreesPerRadian;
}

} // namespace packtrace
