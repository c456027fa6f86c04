#pragma once

#include <random>
#include <vector>

#include "compress/bake/bake_scene.h"
#include "compress/format/file/baked_file.h"
#include "runtime/trace/packed/scene/packed_tracer.h"
#include "runtime/trace/source/packed_source.h"
#include "tests/runtime/trace/test_scenes.h"

namespace packtrace::test {

/// A baked scene and a source that reads it.
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

/// Rays between random points of a box, which is enlarged by a quarter on every side. They are in unit space; t = 1 at
/// the second point.
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

/// Rays from one origin in a cone, ordered by blocks of neighbours as camera rays are. Some have a limited range of t.
inline std::vector<Ray> cone(const UnitSpace& space, const DVec3& from, const DVec3& towards, double width) {
  std::vector<Ray> rays;
  for (int i = 0; i < 64 * 64; ++i) {
    const int block = i / 16, within = i % 16;
    const double x = (block % 16 * 4 + within % 4 - 32) * width / 32,
                 y = (block / 16 * 4 + within / 4 - 32) * width / 32;
    Ray ray;
    ray.origin = Vec3(space.to_unit(from));
    ray.direction = Vec3(towards + DVec3(x, y, -0.5 * x));
    if (i % 7 == 0) ray.tnear = static_cast<float>(space.scale() * 4.0);
    if (i % 5 == 0) ray.tfar = static_cast<float>(space.scale() * 9.0);
    rays.push_back(ray);
  }
  return rays;
}

/// World shapes and instances: rotated, mirrored, squeezed and far apart. One shape is masked, one does not occlude and
/// one is invisible.
inline Scene varied_scene() {
  Scene scene;
  add_shape(scene, quad({-8, 0, -8}, {0, 0, 16}, {16, 0, 0}));
  add_shape(scene, quad({-4, 0, 4}, {8, 0, 0}, {0, 5, 0}), kAlphaMask);
  scene.masks.push_back({64, 1, WrapMode::kRepeat, Vec2(4, 1), Vec2(0), {0u, ~0u}});
  scene.materials[1].alpha_mask = 0;
  add_shape(scene, sphere({3, 1, 0}, 1, 24), kTransmissive);
  add_shape(scene, sphere({3, 4, 0}, 1, 24), kInvisible);
  add_object(scene, sphere({0, 0, 0}, 1, 32));
  for (const DVec3 scale : {DVec3(1), DVec3(-1, 0.7, 1), DVec3(0.5, 1.5, 0.5), DVec3(4, 0.01, -2)})
    scene.instances.push_back({0, Affine(placed({-2.5 * scale.y, 1, 4 * scale.x - 4}, scale, 25))});
  scene.instances.push_back({0, Affine(placed({3000, 20, -500}, DVec3(2), 70, {1, 1, 0}))});
  return scene;
}

/// The same scene with 200 small overlapping instances, which are rotated, mirrored and squeezed.
inline Scene thicket_scene() {
  Scene scene = varied_scene();
  std::mt19937 generator(11);
  std::uniform_real_distribution<double> along(0.0, 1.0);
  for (int i = 0; i < 200; ++i) {
    const double x = 12.0 * along(generator) - 6.0, y = 3.0 * along(generator), z = 12.0 * along(generator) - 6.0;
    const double size = 0.2 + along(generator), side = i % 3 == 0 ? -1.0 : 1.0;
    scene.instances.push_back(
        {0, Affine(placed({x, y, z}, {side * size, 0.5 * size, size}, 360.0 * along(generator), {x, 1, z}))});
  }
  return scene;
}

} // namespace packtrace::test
