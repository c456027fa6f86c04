#pragma once

#include <cstdint>

#include "pbrt_import/scene/scene.h"
#include "pbrt_import/shapes/report.h"

namespace packtrace {

/// True only if clean_up_mesh() would neither change nor report anything and leave triangles. Told without allocations,
/// for small meshes only, since most small ones are clean.
bool is_clean(const Mesh& mesh);

/// Establishes the contract of Mesh. Drops triangles with an index out of range, a repeated index or a non-finite
/// vertex, then unreferenced vertices, without changing the order of the rest. Drops normals or uvs whose count differs
/// from that of the positions. Normalises normals, and recomputes zero or non-finite ones from the surrounding faces.
/// Sets non-finite uvs to zero. Triangles with distinct indices whose corners coincide in space are kept, as in
/// pbrt-v3, and noted.
/// @param report receives one diagnostic per kind of problem, with its count and the first triangle or vertex number
/// @return the number of triangles dropped
uint64_t clean_up_mesh(Mesh& mesh, const ReportFn& report);

} // namespace packtrace
