#pragma once

#include <random>
#include <vector>

#include "compress/bake/bake_scene.h"
#include "compress/format/baked_file.h"
#include "runtime/trace/packed/packed_tracer.h"
#include "runtime/trace/packed_source.h"

namespace packtrace::test {

/// A scene as baked, and what reads it.
struct BakedScene {
  explicit BakedScene(const Scene& scene, const BakeConfig& config = {}) : file(bake(scene, config)), source(file) {}
  BakedScene(const BakedScene&) = delete;
  BakedScene& operator=(const BakedScene&) = delete;

  const BakedFile file;
  const PackedSource source;

private:
  static BakedFile bake(const Scene& scene, const BakeConfig& config) {
    Diagnostics diagnostics;
    Progress progress;
    return BakedFile::from_bytes(bake_to_bytes(scene, config, diagnostics, progress).bytes);
  }
};

/// The instruction sets that this machine can run.
inline std::vector<PackedIsa> isas() {
  std::vector<PackedIsa> result;
  for (const PackedIsa isa : {PackedIsa::kScalar, PackedIsa::kAvx2, PackedIsa::kAvx512})
    if (isa_supported(isa)) result.push_back(isa);
  return result;
}

inline std::vector<RayHit> closest(const RayTracer& tracer, std::span<const Ray> rays,
                                   uint32_t ray_class = kCameraRays) {
  std::vector<RayHit> hits(rays.size());
  tracer.closest_hits(rays, ray_class, RayOrder::kIncoherent, hits);
  return hits;
}

inline std::vector<uint8_t> any(const RayTracer& tracer, std::span<const Ray> rays,
                                uint32_t ray_class = kOcclusionRays) {
  std::vector<uint8_t> occluded(rays.size());
  tracer.any_hits(rays, ray_class, RayOrder::kIncoherent, occluded);
  return occluded;
}

/// Rays between random points of a box, a little larger than the scene's in unit space; t = 1 at the second point.
inline std::vector<Ray> random_rays(size_t count, const Bounds& world, const UnitSpace& space, uint32_t seed = 1) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> along(-0.25, 1.25);
  const DVec3 lo = space.to_unit(world.lo), size = space.to_unit(world.hi) - lo;
  const auto point = [&] {
    const double x = along(generator), y = along(generator), z = along(generator);
    return lo + size * DVec3(x, y, z);
  };
  std::vector<Ray> rays(count);
  for (Ray& ray : rays) {
    const DVec3 a = point(), b = point();
    ray.origin = Vec3(a), ray.direction = Vec3(b - DVec3(ray.origin));
  }
  return rays;
}

} // namespace packtrace::test
