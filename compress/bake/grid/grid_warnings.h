#pragma once

#include <span>
#include <string>
#include <vector>

#include "compress/bake/grid/geometry_grid.h"
#include "compress/bake/grid/scene_measure.h"

namespace packtrace {

/// Returns warnings of grids that are coarse for their geometry, and of floats that are coarse for the scene.
/// @param grids per geometry of `measure`
std::vector<std::string> grid_warnings(const Scene& scene, const SceneMeasure& measure,
                                       std::span<const GeometryGrid> grids);

} // namespace packtrace
