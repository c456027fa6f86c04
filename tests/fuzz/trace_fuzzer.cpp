// Fuzzes tracing of packed files: files that pass validation can be traced by every kernel this machine supports,
// whatever their trees, bounds and transforms. Hits refer to existing triangles. Kernels need not agree, because node
// bounds in such files need not contain their contents.

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "compress/format/file/baked_file.h"
#include "runtime/trace/packed/scene/packed_tracer.h"
#include "runtime/trace/source/lod_source.h"
#include "runtime/trace/source/packed_source.h"
#include "tests/fuzz/baked_input.h"

namespace packtrace::fuzz {
namespace {

constexpr uint32_t kRays = 48;      // a group of 16 coherent rays, and less coherent ones
constexpr uint32_t kManyRays = 600; // enough to be traced together through a tree over instances

/// Rays from within and around the scene. The last two have no direction and an empty interval.
std::vector<Ray> rays_through(const UnitSpace& space, const Bounds& world, uint32_t count) {
  const DVec3 lo = world.empty() ? DVec3(-1) : space.to_unit(DVec3(world.lo));
  const DVec3 hi = world.empty() ? DVec3(1) : space.to_unit(DVec3(world.hi));
  std::vector<Ray> rays(count);
  for (uint32_t i = 0; i < count; ++i) {
    const auto at = [&](uint32_t salt) {
      DVec3 weights;
      for (uint32_t axis = 0; axis < 3; ++axis)
        weights[static_cast<int>(axis)] = double((salt * 2654435761u >> (5 + 9 * axis)) & 255u) / 255.0;
      return lo + (hi - lo) * weights;
    };
    const bool coherent = i < 16;
    const DVec3 from = coherent ? lo - (hi - lo) : at(3 * i);
    const DVec3 to = coherent ? lo + (hi - lo) * DVec3(0.1 + 0.2 * (i & 3), 0.1 + 0.2 * (i >> 2), 0.5) : at(3 * i + 1);
    rays[i].origin = Vec3(from), rays[i].direction = Vec3(to - from);
    if (i % 5 == 4) rays[i].direction[static_cast<int>(i % 3)] = 0.0f; // parallel to an axis plane
  }
  rays[count - 2].direction = Vec3(0.0f);
  rays[count - 1].tfar = -1.0f;
  return rays;
}

/// @param Source PackedSource or LodSource
template <class Source>
void trace(const BakedFile& file, const Source& source, PackedIsa isa) {
  const PackedTracer tracer(file, source, isa);
  const bool many = file.instances().size() > baked::kNodeWidth;
  const std::vector<Ray> rays = rays_through(tracer.space(), source.world_bounds(), many ? kManyRays : kRays);
  std::vector<RayHit> hits(rays.size());
  std::vector<uint8_t> occluded(rays.size());
  for (const uint32_t ray_class : {kCameraRays, kOcclusionRays})
    for (const RayOrder order : {RayOrder::kCoherent, RayOrder::kIncoherent}) {
      tracer.closest_hits(rays, ray_class, order, hits);
      tracer.any_hits(rays, ray_class, order, occluded);
      for (size_t i = 0; i < rays.size(); ++i) {
        require(occluded[i] <= 1, "occluded is not 0 or 1");
        if (!hits[i].valid()) continue;
        require(hits[i].t >= rays[i].tnear && hits[i].t <= rays[i].tfar, "hit outside the interval");
        const HitSurface surface = tracer.resolve(hits[i]);
        require(surface.placement && surface.placement->instance < source.instances().size(), "instance of a hit");
        require(source.instances()[surface.placement->instance].geometry == surface.geometry, "geometry of a hit");
        require(surface.triangle < source.counts(surface.geometry).triangles, "triangle of a hit");
        require(source.material_of(surface.placement->instance, surface.triangle) < source.materials().size(),
                "material");
        (void)source.shading_normal(surface.geometry, surface.triangle, Vec2(hits[i].u, hits[i].v));
        (void)source.detail_of(surface.placement->instance, surface.triangle);
      }
    }
}

template <class Source>
void trace(const BakedFile& file, const Source& source) {
  for (const PackedIsa isa : {PackedIsa::kScalar, PackedIsa::kAvx2, PackedIsa::kAvx512})
    if (isa_supported(isa)) trace(file, source, isa);
}

/// Traces at levels of detail where some groups pass and others do not.
void trace_levels(const BakedFile& file, const PackedSource& source) {
  const Bounds world = source.world_bounds();
  const double size = world.empty() ? 0.0 : glm::length(DVec3(world.hi) - DVec3(world.lo));
  if (file.sections().lod_levels.empty() || !std::isfinite(size) || size <= 0.0) return;
  const std::vector<LodGeometry> geometries = lod_geometries(file);
  const std::vector<LodInstance> instances = lod_instances(source);
  LodSharing sharing(geometries, instances, {});
  for (const double error_per_distance : {1e-3, 1e-1}) {
    const LodPlan plan = sharing.plan({DVec3(world.hi) + DVec3(size), size * 1e-6, error_per_distance});
    trace(file, LodSource(file, source, sharing, plan));
  }
}

} // namespace
} // namespace packtrace::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace packtrace;
  const std::span bytes = std::as_bytes(std::span(data, size));
  std::vector<std::byte> repaired(bytes.begin(), bytes.end());
  fuzz::repair(repaired);
  fuzz::expect_read_or_refused([&] {
    const BakedFile file = BakedFile::from_bytes(repaired);
    const PackedSource source(file);
    fuzz::trace(file, source);
    fuzz::trace_levels(file, source);
  });
  return 0;
}
