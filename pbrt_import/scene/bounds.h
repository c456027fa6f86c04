#pragma once

#include <limits>
#include <span>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Axis-aligned box, closed on both sides. Default: empty (lo > hi).
struct Bounds {
  DVec3 lo{std::numeric_limits<double>::infinity()};
  DVec3 hi{-std::numeric_limits<double>::infinity()};

  bool empty() const { return !(lo.x <= hi.x && lo.y <= hi.y && lo.z <= hi.z); }
  void extend(DVec3 p) { lo = glm::min(lo, p), hi = glm::max(hi, p); }
  void extend(const Bounds& other) { lo = glm::min(lo, other.lo), hi = glm::max(hi, other.hi); }
  DVec3 extent() const { return empty() ? DVec3(0.0) : hi - lo; }
  DVec3 centre() const { return (lo + hi) * 0.5; }
  double diagonal() const { return glm::length(extent()); }
};

/// Bounds of the eight transformed corners; empty bounds stay empty.
Bounds transform_bounds(const DAffine& to_from, const Bounds& bounds);

/// Bounds of all points.
Bounds bounds_of(std::span<const Vec3> points);

} // namespace packtrace
