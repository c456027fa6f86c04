#include "tests/benchmarks/trace_benchmark_counts.h"

#include <cstdio>
#include <vector>

#include <fmt/core.h>

#include "runtime/trace/packed/scene/packed_tracer.h"

namespace packtrace {
namespace {

packed::KernelCounters count(const RecordedRays& recorded, const PackedTracer& tracer) {
  packed::KernelCounters counters;
  std::vector<uint8_t> occluded(recorded.any ? recorded.rays.size() : 0);
  std::vector<RayHit> hits(recorded.any ? 0 : recorded.rays.size());
  size_t first = 0;
  for (const size_t end : recorded.ends) {
    const std::span rays = std::span(recorded.rays).subspan(first, end - first);
    if (recorded.any)
      tracer.count_any(rays, recorded.ray_class, std::span(occluded).subspan(first, rays.size()), counters);
    else
      tracer.count_closest(rays, recorded.ray_class, std::span(hits).subspan(first, rays.size()), counters);
    first = end;
  }
  return counters;
}

} // namespace

nlohmann::ordered_json count_work(std::span<const RecordedRays> rays, const RayTracer& tracer) {
  const auto* const packed = dynamic_cast<const PackedTracer*>(&tracer);
  nlohmann::ordered_json phases = nlohmann::ordered_json::array();
  if (packed == nullptr) return phases;
  fmt::print("\nwork per ray, packed: placements, nodes tested, nodes unpacked, leaves, triangles, batches decoded\n");
  for (const RecordedRays& phase : rays) {
    const packed::KernelCounters counters = count(phase, *packed);
    const auto ray_count = static_cast<double>(phase.count());
    const auto per_ray = [&](uint64_t number) { return static_cast<double>(number) / ray_count; };
    phases.push_back({{"phase", phase.name},
                      {"placements", per_ray(counters.placements)},
                      {"nodes", per_ray(counters.node_rays)},
                      {"unpacked", per_ray(counters.nodes)},
                      {"leaves", per_ray(counters.leaf_rays)},
                      {"triangles", per_ray(counters.triangles)},
                      {"batches_decoded", per_ray(counters.batches_decoded)},
                      {"exact_triangles", per_ray(counters.exact_triangles)}});
    fmt::print("{}: {:.2f}, {:.2f}, {:.2f}, {:.2f}, {:.1f}, {:.3f}\n", phase.name, per_ray(counters.placements),
               per_ray(counters.node_rays), per_ray(counters.nodes), per_ray(counters.leaf_rays),
               per_ray(counters.triangles), per_ray(counters.batches_decoded));
  }
  std::fflush(stdout);
  return phases;
}

} // namespace packtrace
