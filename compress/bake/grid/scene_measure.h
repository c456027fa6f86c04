#pragma once

#include <vector>

#include "compress/bake/grid/geometry_measure.h"
#include "compress/bake/plan/geometry_plan.h"
#include "pbrt_import/base/progress.h"

namespace packtrace {

/// What choosing grids needs to know of a scene.
struct SceneMeasure {
  std::vector<GeometryMeasure> geometries; ///< as in the plan
  GeometryMeasure world;                   ///< of all shapes outside objects, also of instanced ones
  bool has_world_space = false;            ///< some geometry of the world's space has a position
};

/// Advances `progress` by one for each geometry. Throws like measure_geometry().
SceneMeasure measure_scene(const Scene& scene, const ScenePlan& plan, Progress& progress);

DAffine placement_of(const baked::InstanceRecord& instance);

/// Box of an instance, from that of its geometry.
Bounds placed_box(const baked::InstanceRecord& instance, const Bounds& box);

} // namespace packtrace
