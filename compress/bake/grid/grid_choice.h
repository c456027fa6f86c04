#pragma once

#include <cstdint>
#include <vector>

#include "compress/bake/bake_config.h"
#include "compress/bake/grid/geometry_grid.h"
#include "compress/bake/grid/picture_bounds.h"
#include "compress/bake/grid/scene_measure.h"
#include "pbrt_import/base/progress.h"

namespace packtrace {

/// Geometry whose pictures may differ from the source's by more than the default precision promises. Lengths are in
/// units of the geometry's space.
struct Shortfall {
  uint32_t geometry = 0;
  PictureBound bound = PictureBound::kNone; ///< what is not kept
  double wanted = 0.0;                      ///< the step that would keep it
  double step = 0.0;                        ///< that the geometry has
  bool float_limit = false;                 ///< the step is as fine as floats are where the geometry lies
};

/// The lattices of a scene.
struct GridChoice {
  PositionGrid world;              ///< the scene's; without meaning where nothing lies in world space
  std::vector<GeometryGrid> grids; ///< by geometry
  std::vector<uint32_t> halvings;  ///< of the scene's step, by geometry
  uint64_t nested_geometries = 0;  ///< on finer grids than the scene's, as they are small (halvings_of_small_things())
  uint64_t finer_geometries = 0;   ///< on finer grids than the median edge asks for, as pictures need them
  std::vector<Shortfall> shortfalls;
};

/// Chooses a lattice for each geometry. With PrecisionKind::kPicture steps are as fine as pictures need
/// (bound_steps()), then checked, and halved up to three times where the check fails; other kinds mean what they say
/// and are checked only.
GridChoice choose_grids(const Scene& scene, const ScenePlan& plan, const SceneMeasure& measure,
                        const BakeConfig& config, Progress& progress);

} // namespace packtrace
