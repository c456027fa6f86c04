#include "pbrt_import/scene/bounds.h"

namespace packtrace {

Bounds transform_bounds(const DAffine& to_from, const Bounds& bounds) {
  Bounds result;
  if (bounds.empty()) return result;
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
