#pragma once

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// A weighted sum of squared distances from planes, as a function of the point p: p^T A p + 2 b p + c.
/// Source: Michael Garland and Paul S. Heckbert, Surface Simplification Using Quadric Error Metrics, 1997.
struct Quadric {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0; ///< A, symmetric
  double bx = 0, by = 0, bz = 0, c = 0;

  /// Adds the plane through `point` with unit normal n.
  void add_plane(DVec3 n, DVec3 point, double weight) {
    const double d = -glm::dot(n, point);
    const DVec3 w = weight * n;
    xx += w.x * n.x, xy += w.x * n.y, xz += w.x * n.z, yy += w.y * n.y, yz += w.y * n.z, zz += w.z * n.z;
    bx += w.x * d, by += w.y * d, bz += w.z * d, c += weight * d * d;
  }

  /// Adds the line through `point` along the unit vector d.
  void add_line(DVec3 d, DVec3 point, double weight) {
    add_point(point, weight);
    add_plane(d, point, -weight); // leaves the distance across the line
  }

  /// Adds the distance from the point itself, which keeps minima near it.
  void add_point(DVec3 point, double weight) {
    xx += weight, yy += weight, zz += weight;
    bx -= weight * point.x, by -= weight * point.y, bz -= weight * point.z, c += weight * glm::dot(point, point);
  }

  void add(const Quadric& o) {
    xx += o.xx, xy += o.xy, xz += o.xz, yy += o.yy, yz += o.yz, zz += o.zz;
    bx += o.bx, by += o.by, bz += o.bz, c += o.c;
  }
};

} // namespace packtrace
