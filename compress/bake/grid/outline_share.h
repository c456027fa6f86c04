#pragma once

#include "compress/bake/plan/geometry_plan.h"

namespace packtrace {

/// Expected fraction of a geometry's edge length that is outline, seen from a random direction. Open edges count fully;
/// an edge between two triangles counts by the angle between their normals, divided by pi. 1 for loose triangles, near
/// 0 for smooth surfaces.
/// Estimated from the triangles around about 1024 positions. Equal positions count as one, whatever their indices.
double outline_share(const Scene& scene, const GeometryPlan& plan);

} // namespace packtrace
