#pragma once

#include <cstdint>
#include <vector>

#include "compress/bake/bake_config.h"
#include "compress/bake/grid/geometry_grid.h"
#include "compress/bake/grid/picture_bounds.h"
#include "compress/bake/grid/scene_measure.h"
#include "pbrt_import/base/progress.h"

namespace packtrace {

/// A geometry whose images may differ from the source's by more than the default precision promises. Lengths are in the
/// geometry's own units.
struct Shortfall {
  uint32_t geometry = 0;
  PictureBound bound = PictureBound::kNone; ///< the bound that is exceeded
  double wanted = 0.0;                      ///< the step that would satisfy the bound
  double step = 0.0;                        ///< the geometry's step
  bool float_limit = false; ///< the step is already as fine as float spacing at the geometry's coordinates
};

/// Lattices of all geometries of a scene.
struct GridChoice {
  PositionGrid world;              ///< the scene's grid; unused if no geometry lies in world space
  std::vector<GeometryGrid> grids; ///< per geometry
  std::vector<uint32_t> halvings;  ///< per geometry: how often the scene's step is halved
  /// Small world-space geometries on finer grids than the scene's (halvings_of_small_geometries()).
  uint64_t nested_geometries = 0;
  /// Geometries whose steps are finer than the median edge requires, because images need it.
  uint64_t finer_geometries = 0;
  /// Meshes with positions off the lattice that they state (stated_grids()).
  uint64_t false_lattices = 0;
  std::vector<Shortfall> shortfalls;
};

/// Chooses a lattice for each geometry. With PrecisionKind::kPicture, geometries whose meshes state a lattice keep it
/// (stated_grids()). The others' steps satisfy bound_steps(); they are then
/// checked and halved up to three times where the check fails. With other kinds, the steps follow from config alone and
/// are only checked.
GridChoice choose_grids(const Scene& scene, const ScenePlan& plan, const SceneMeasure& measure,
                        const BakeConfig& config, Progress& progress);

} // namespace packtrace
