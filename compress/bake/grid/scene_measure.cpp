#include "compress/bake/grid/scene_measure.h"

#include <cmath>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

namespace packtrace {
namespace {

/// Whether a shape outside objects is instanced. Such shapes are the first instances of the plan.
bool is_instanced_shape(const ScenePlan& plan, const baked::InstanceRecord& instance) {
  return instance.geometry != baked::kNone && !plan.geometries[instance.geometry].world_space;
}

/// Returns, per geometry, the scales of its instanced world shapes: the root mean square over the axes. These shapes
/// count towards the scene's step like all other shapes outside objects.
std::vector<std::vector<double>> instanced_scales(const Scene& scene, const ScenePlan& plan) {
  std::vector<std::vector<double>> scales(plan.geometries.size());
  for (size_t i = 0; i < scene.shapes.size(); ++i) {
    const baked::InstanceRecord& instance = plan.instances[i];
    if (!is_instanced_shape(plan, instance)) continue;
    double sum = 0.0;
    for (size_t k = 0; k < 9; ++k) sum += double{instance.world_from_object[k]} * instance.world_from_object[k];
    scales[instance.geometry].push_back(std::sqrt(sum / 3.0));
  }
  return scales;
}

} // namespace

SceneMeasure measure_scene(const Scene& scene, const ScenePlan& plan, Progress& progress) {
  struct Scratch {
    LengthHistogram world, local;
  };
  SceneMeasure result;
  std::vector<GeometryMeasure>& measures = result.geometries;
  measures.resize(plan.geometries.size());
  tbb::enumerable_thread_specific<Scratch> scratch;
  const std::vector<std::vector<double>> scales = instanced_scales(scene, plan);
  tbb::parallel_for(size_t{0}, measures.size(), [&](size_t i) {
    Scratch& mine = scratch.local();
    mine.local.clear();
    measures[i].bounds = measure_geometry(scene, plan.geometries[i], mine.local);
    measures[i].median_edge = mine.local.median();
    if (plan.geometries[i].world_space) mine.world.add(mine.local);
    for (const double scale : scales[i]) mine.world.add_scaled(mine.local, scale);
    progress.advance();
  });
  LengthHistogram edges;
  for (const Scratch& one : scratch) edges.add(one.world);
  result.world.median_edge = edges.median();
  for (size_t i = 0; i < measures.size(); ++i)
    if (plan.geometries[i].world_space) {
      result.world.bounds.extend(measures[i].bounds);
      result.has_world_space |= !measures[i].bounds.empty();
    }
  for (size_t i = 0; i < scene.shapes.size(); ++i)
    if (const baked::InstanceRecord& instance = plan.instances[i]; is_instanced_shape(plan, instance))
      result.world.bounds.extend(placed_box(instance, measures[instance.geometry].bounds));
  return result;
}

DAffine placement_of(const baked::InstanceRecord& instance) {
  const auto& m = instance.world_from_object;
  return DAffine(m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8], m[9], m[10], m[11]);
}

Bounds placed_box(const baked::InstanceRecord& instance, const Bounds& box) {
  return transform_bounds(placement_of(instance), box);
}

} // namespace packtrace
