#pragma once

#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// Sets kOuterSideOpposite of the materials that emit light or refract it, where the vertex normals of most triangles
/// of a shape point against the winding of its mesh: pbrt takes the side of the vertex normals as the outer one. A
/// material that shapes of both kinds use is copied.
/// Source: pbrt-v3, Triangle::Intersect and Triangle::Sample.
void find_outer_sides(Scene& scene);

} // namespace packtrace
