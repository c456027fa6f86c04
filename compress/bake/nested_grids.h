#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/geometry_measure.h"
#include "compress/bake/geometry_plan.h"

namespace packtrace {

/// How often the scene's step is halved for each world-space geometry, 0 for others: where config asks for a fraction
/// of the median edge, things much smaller than the scene's triangles would vanish on the scene's grid.
///
/// A geometry is small if the scene's step exceeds max(16 precision, 1/8) of its own median edge. It gets the coarsest
/// step 2^-k times the scene's that is at most precision times its own median edge, unless floats are coarser there.
/// The scene's lattice points are points of the finer lattice as well. Geometry that has a position in common with
/// geometry that is not small keeps the scene's grid, so that the two stay closed; small geometries that have positions
/// in common get the finest step among them.
/// @param world_step of the scene's grid
std::vector<uint32_t> nest_grids(const Scene& scene, const ScenePlan& plan, std::span<const GeometryMeasure> measures,
                                 const BakeConfig& config, double world_step);

} // namespace packtrace
