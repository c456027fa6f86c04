#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/grid/geometry_grid.h"
#include "compress/bake/grid/geometry_measure.h"
#include "compress/bake/plan/geometry_plan.h"

namespace packtrace {

/// For each world-space geometry, how often to halve the scene's step; 0 for other geometries. Used if precision is a
/// fraction of the median edge: things much smaller than the scene's triangles would vanish on the scene's grid.
///
/// A geometry is small if the scene's step exceeds max(16 * precision, 1/8) of the geometry's own median edge. It gets
/// the coarsest step, of the scene's step times 2^-k, that is at most precision times its own median edge, but no step
/// below 2^-23 of its largest coordinate.
/// @param world_step step of the scene's grid
std::vector<uint32_t> halvings_of_small_geometries(const ScenePlan& plan, std::span<const GeometryMeasure> measures,
                                                   double precision, double world_step);

/// How often the scene's step may be halved for a world-space geometry so that it stays at least `finest` and within
/// the limits of lattices.
uint32_t max_halvings(const GeometryMeasure& measure, double world_step, double finest);

/// Returns, for each geometry, the positions that coarser world-space geometries have too; see GeometryGrid.
/// @param halvings per geometry: how often the scene's step is halved; 0 for geometries that are not in world space
std::vector<std::vector<SharedPosition>> find_shared_positions(const Scene& scene, const ScenePlan& plan,
                                                               std::span<const GeometryMeasure> measures,
                                                               std::span<const uint32_t> halvings);

} // namespace packtrace
