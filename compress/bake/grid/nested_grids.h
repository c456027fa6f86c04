#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/grid/geometry_grid.h"
#include "compress/bake/grid/geometry_measure.h"
#include "compress/bake/plan/geometry_plan.h"

namespace packtrace {

/// How often the scene's step is halved for each world-space geometry, 0 for others, where precision is a fraction of
/// the median edge: things much smaller than the scene's triangles would vanish on the scene's grid.
///
/// A geometry is small if the scene's step exceeds max(16 precision, 1/8) of its own median edge. It gets the coarsest
/// step 2^-k times the scene's that is at most precision times its own median edge, unless floats are coarser there.
/// @param world_step of the scene's grid
std::vector<uint32_t> halvings_of_small_things(const ScenePlan& plan, std::span<const GeometryMeasure> measures,
                                               double precision, double world_step);

/// How often the scene's step may be halved for a world-space geometry: its step stays at least `finest` and within the
/// limits of lattices.
uint32_t max_halvings(const GeometryMeasure& measure, double world_step, double finest);

/// By geometry: the positions that coarser world-space geometry has too; see GeometryGrid.
/// @param halvings of the scene's step, by geometry; 0 for geometry that is not in world space
std::vector<std::vector<SharedPosition>> find_shared_positions(const Scene& scene, const ScenePlan& plan,
                                                               std::span<const GeometryMeasure> measures,
                                                               std::span<const uint32_t> halvings);

} // namespace packtrace
