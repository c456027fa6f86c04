#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "compress/bake/plan/geometry_plan.h"
#include "compress/format/cluster/position_grid.h"

namespace packtrace {

/// Lattices that the meshes of a scene state (Mesh::lattice), as exports of baked files do.
struct StatedGrids {
  /// Of the world's grid: the coarsest of its geometries. None unless all geometries in world space state grids whose
  /// steps are powers of two apart.
  std::optional<PositionGrid> world;
  std::vector<std::optional<PositionGrid>> grids; ///< per geometry
  uint64_t false_lattices = 0; ///< meshes with positions off the lattice that they state, which does not count
};

/// Finds the lattices on which the positions of geometries already lie, so that baking an export gives the positions of
/// the file that was exported. A geometry has one if all its meshes state it, their positions lie on it up to an
/// eighth of a step or the rounding of floats at the largest coordinate of its step, and their maps into the geometry
/// keep it: a uniform scale that gives a step of PositionGrid, mirrored or not, and a translation by whole steps.
StatedGrids stated_grids(const Scene& scene, const ScenePlan& plan);

} // namespace packtrace
