#pragma once

#include <vector>

#include "compress/bake/grid/geometry_measure.h"
#include "compress/bake/plan/geometry_plan.h"
#include "pbrt_import/base/progress.h"

namespace packtrace {

/// Measurements of a scene for choosing grids.
struct SceneMeasure {
  std::vector<GeometryMeasure> geometries; ///< in the plan's order
  GeometryMeasure world;                   ///< of all shapes outside objects, including instanced ones
  bool has_world_space = false;            ///< some world-space geometry has a position
};

/// Measures all geometries. Advances `progress` by one per geometry. Throws like measure_geometry().
SceneMeasure measure_scene(const Scene& scene, const ScenePlan& plan, Progress& progress);

/// Returns world_from_object of an instance.
DAffine placement_of(const baked::InstanceRecord& instance);

/// World-space bounds of an instance, from the bounds of its geometry.
Bounds placed_box(const baked::InstanceRecord& instance, const Bounds& box);

} // namespace packtrace
