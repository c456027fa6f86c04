#pragma once

#include <cstdint>

#include "pbrt_import/scene/scene.h"
#include "pbrt_import/shapes/report.h"

namespace packtrace {

/// Makes mesh keep the contract of Mesh: drops triangles with an index out of range, a repeated index or a vertex that
/// is not finite, then unreferenced vertices, both without changing the order of the rest; drops normals or uvs whose
/// count differs from the positions'; makes normals unit length, recomputing those that are zero or not finite from the
/// faces around them; zeroes uvs that are not finite. Triangles whose corners differ in index but coincide in space
/// stay, as in pbrt-v3: they are only noted.
/// @param report one diagnostic per kind of problem, with its count and the first triangle or vertex number
/// @return the number of triangles dropped
uint64_t drop_bad_triangles(Mesh& mesh, const ReportFn& report);

} // namespace packtrace
