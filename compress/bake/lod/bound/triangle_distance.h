#pragma once

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// The point of the triangle (a, b, c) nearest to p. Degenerate triangles count as segments.
DVec3 nearest_point(const DVec3& p, const DVec3& a, const DVec3& b, const DVec3& c);

/// The point of the segment (a, b) nearest to p.
DVec3 nearest_point(const DVec3& p, const DVec3& a, const DVec3& b);

} // namespace packtrace
