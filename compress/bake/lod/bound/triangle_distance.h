#pragma once

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// The point of the triangle (a, b, c) nearest to p. Degenerate triangles count as segments.
DVec3 nearest_point(DVec3 p, DVec3 a, DVec3 b, DVec3 c);

/// The point of the segment (a, b) nearest to p.
DVec3 nearest_point(DVec3 p, DVec3 a, DVec3 b);

} // namespace packtrace
