#pragma once

#include <algorithm>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// A weighted sum of squared distances to planes, as a function of the point: p^T A p + 2 b p + c.
/// Source: Michael Garland and Paul S. Heckbert, Surface Simplification Using Quadric Error Metrics, 1997.
struct Quadric {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0; ///< A, symmetric
  double bx = 0, by = 0, bz = 0, c = 0;

  /// The plane through `point` with unit normal n.
  void add_plane(DVec3 n, DVec3 point, double weight) {
    const double d = -glm::dot(n, point);
    const DVec3 w = weight * n;
    xx += w.x * n.x, xy += w.x * n.y, xz += w.x * n.z, yy += w.y * n.y, yz += w.y * n.z, zz += w.z * n.z;
    bx += w.x * d, by += w.y * d, bz += w.z * d, c += weight * d * d;
  }

  /// The point itself: keeps what is placed near it.
  void add_point(DVec3 point, double weight) {
    xx += weight, yy += weight, zz += weight;
    bx -= weight * point.x, by -= weight * point.y, bz -= weight * point.z, c += weight * glm::dot(point, point);
  }

  void add(const Quadric& o) {
    xx += o.xx, xy += o.xy, xz += o.xz, yy += o.yy, yz += o.yz, zz += o.zz;
    bx += o.bx, by += o.by, bz += o.bz, c += o.c;
  }

  /// Half the gradient at p.
  DVec3 slope(DVec3 p) const {
    return {xx * p.x + xy * p.y + xz * p.z + bx, xy * p.x + yy * p.y + yz * p.z + by,
            xz * p.x + yz * p.y + zz * p.z + bz};
  }

  /// Rounding may make it a little negative where it should be 0; never is here.
  double at(DVec3 p) const { return std::max(glm::dot(p, slope(p)) + bx * p.x + by * p.y + bz * p.z + c, 0.0); }

  /// Where it is least; along directions in which it hardly changes, close to `from`.
  DVec3 minimum(DVec3 from) const {
    constexpr double kFlat = 1e-4; // of the trace; less curved directions are left alone
    const double stay = kFlat * (xx + yy + zz);
    if (!(stay > 0.0)) return from;
    // Cholesky factors of A + stay I.
    const double l0 = 1.0 / std::sqrt(xx + stay), l10 = xy * l0, l20 = xz * l0;
    const double l1 = 1.0 / std::sqrt(yy + stay - l10 * l10), l21 = (yz - l10 * l20) * l1;
    const double l2 = 1.0 / std::sqrt(zz + stay - l20 * l20 - l21 * l21);
    const DVec3 g = slope(from);
    const double y0 = g.x * l0, y1 = (g.y - l10 * y0) * l1, y2 = (g.z - l20 * y0 - l21 * y1) * l2;
    const double z = y2 * l2, y = (y1 - l21 * z) * l1, x = (y0 - l10 * y - l20 * z) * l0;
    return from - DVec3(x, y, z);
  }
};

} // namespace packtrace
