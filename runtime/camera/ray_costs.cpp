#include "runtime/camera/ray_costs.h"

#include <algorithm>
#include <limits>

#include "runtime/camera/primary_visibility.h"
#include "runtime/camera/ray_columns.h"
#include "runtime/camera/tiles.h"
#include "runtime/trace/packed/kernels/kernel_types.h"
#include "runtime/trace/packed/scene/packed_tracer.h"

namespace packtrace {

RayCosts count_ray_costs(const PackedTracer& tracer, const PrimaryCamera& view) {
  RayCosts costs;
  costs.size = view.size();
  for (std::vector<uint32_t>* counts : {&costs.nodes, &costs.leaves, &costs.triangles})
    counts->assign(costs.size.pixels(), 0);
  Progress unseen;
  for_each_tile(costs.size, {kMaxColumnRays, 1}, unseen, [&](const Tile& tile) {
    RayColumns columns;
    const uint32_t count = tile.x1 - tile.x0;
    for (uint32_t i = 0; i < count; ++i) columns.x[i] = tile.x0 + i, columns.y[i] = tile.y0;
    write_rays(view, tracer.space(), count, columns);
    for (uint32_t i = 0; i < count; ++i) {
      CameraRay ray{columns.origin.at(i), columns.direction.at(i)};
      if (!approach_scene(ray)) continue;
      const Ray traced{Vec3(ray.origin), 0.0f, Vec3(ray.direction), std::numeric_limits<float>::infinity()};
      RayHit hit;
      packed::KernelCounters counters{};
      tracer.count_closest({&traced, 1}, kCameraRays, {&hit, 1}, counters);
      const size_t at = size_t{tile.y0} * costs.size.width + tile.x0 + i;
      costs.nodes[at] = static_cast<uint32_t>(counters.nodes);
      costs.leaves[at] = static_cast<uint32_t>(counters.leaves);
      costs.triangles[at] = static_cast<uint32_t>(counters.triangles);
    }
  });
  return costs;
}

} // namespace packtrace
