#pragma once

#include <cstdint>

#include "pbrt_import/scene/scene.h"
#include "pbrt_import/shapes/report.h"

namespace packtrace {

/// A fast sufficient test for small meshes, most of which are clean: if it is true, clean_up_mesh() would leave the
/// mesh as it is, report nothing, and the mesh has triangles. Allocates nothing.
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
