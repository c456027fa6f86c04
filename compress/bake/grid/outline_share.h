#pragma once

#include "compress/bake/plan/geometry_plan.h"

namespace packtrace {

/// How much of the length of a geometry's edges is outline, seen from a random direction: open edges count whole, edges
/// between two triangles by the angle between their normals over pi. 1 for loose triangles, near 0 for smooth surfaces.
/// Estimated from the triangles around some 1024 positions; equal positions are one, whatever their indices.
double outline_share(const Scene& scene, const GeometryPlan& plan);

} // namespace packtrace
