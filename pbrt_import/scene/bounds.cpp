#include "pbrt_import/scene/bounds.h"

#include <cmath>

namespace packtrace {

Bounds transform_bounds(const DAffine& to_from, const Bounds& bounds) {
  Bounds result;
  if (bounds.empty()) return result;
  // Rounding is monotonic, so the least sum consists of the least products. Sums of zeros and of infinities are left to
  // the loop, because the order of the corners matters for them.
  DVec3 lo(0.0), hi(0.0);
  for (int column = 0; column < 3; ++column) {
    const DVec3 a = to_from[column] * bounds.lo[column], b = to_from[column] * bounds.hi[column];
    lo = column == 0 ? glm::min(a, b) : lo + glm::min(a, b);
    hi = column == 0 ? glm::max(a, b) : hi + glm::max(a, b);
  }
  lo += to_from[3], hi += to_from[3];
  const auto plain = [](double v) { return v != 0.0 && std::isfinite(v); };
  if (plain(lo.x) && plain(lo.y) && plain(lo.z) && plain(hi.x) && plain(hi.y) && plain(hi.z)) return {lo, hi};
  for (int corner = 0; corner < 8; ++corner)
    result.extend(
        transform_point(to_from, DVec3(corner & 1 ? bounds.hi.x : bounds.lo.x, corner & 2 ? bounds.hi.y : bounds.lo.y,
                                       corner & 4 ? bounds.hi.z : bounds.lo.z)));
  return result;
}

Bounds bounds_of(std::span<const Vec3> points) {
  Bounds result;
  for (const Vec3 p : points) result.extend(DVec3(p));
  return result;
}

} // namespace packtrace
