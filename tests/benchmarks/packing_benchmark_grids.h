#pragma once

#include <span>
#include <string_view>

#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// Names of meshes that consist of regular grids of quads or triangles, 7,200 to 82,000 triangles each.
std::span<const std::string_view> grid_input_names();

/// Returns the mesh with one of these names, without normals. Machines may differ in the rounding of sines.
Mesh make_grid_input(std::string_view name);

} // namespace packtrace
