// Scenes with one extreme object: it must not affect hits on the other objects, nor the speed of tracing them.

#include <cmath>

#include <gtest/gtest.h>

#include "runtime/trace/source/float_source.h"
#include "tests/runtime/trace/embree_cluster_tracer.h"
#include "tests/runtime/trace/packed_scenes.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

using test::add_object;
using test::add_shape;
using test::placed;

const size_t kRays = test::fewer(size_t{20000});

size_t usual_count(const Scene& scene) { return scene.shapes.size() + scene.instances.size(); }

/// The box within which rays start and end.
struct Region {
  DVec3 lo, hi;
};

std::vector<Ray> rays_within(const Region& region, size_t count, const UnitSpace& space) {
  std::mt19937 generator(9);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const auto point = [&] {
    const double x = unit(generator), y = unit(generator), z = unit(generator);
    return space.to_unit(region.lo + (region.hi - region.lo) * DVec3(x, y, z));
  };
  std::vector<Ray> rays(count);
  for (Ray& ray : rays) {
    const DVec3 a = point(), b = point();
    ray.origin = Vec3(a), ray.direction = Vec3(glm::normalize(b - DVec3(ray.origin)));
  }
  return rays;
}

/// Compares a scene with an extreme object with Embree's hits in the scene without it. Rays that Embree finds a hit for
/// must have the same hit; the others must hit nothing or the extreme object. Up to 1 in 200 rays may differ, as rays
/// that pass an outline do.
/// @param usual scene without the extreme object; its instances come first in `scene`
void expect_usual_hits(const Scene& usual, const Scene& scene, const Region& region, size_t least_hits) {
  const FloatSource floats(usual);
  const EmbreeTracer embree(floats, {});
  const std::vector<RayHit> expected = test::closest(embree, rays_within(region, kRays, embree.space()));
  EXPECT_GE(static_cast<size_t>(std::ranges::count_if(expected, &RayHit::valid)), least_hits);
  BakeConfig config;
  config.precision_kind = PrecisionKind::kEdgeFraction;
  config.precision = 1e-4;
  const test::BakedScene baked(scene, config);
  const double size = region.hi.x - region.lo.x;
  const auto check = [&](const RayTracer& tracer) {
    const std::vector<Ray> rays = rays_within(region, kRays, tracer.space());
    const std::vector<RayHit> hits = test::closest(tracer, rays);
    const std::vector<uint8_t> occluded = test::any(tracer, rays);
    const auto way = [](const RayHit& hit, const RayTracer& of) { return double{hit.t} * of.space().inverse_scale(); };
    size_t differences = 0;
    for (size_t i = 0; i < rays.size(); ++i) {
      bool same = hits[i].valid() == (occluded[i] != 0);
      if (expected[i].valid())
        same &= hits[i].valid() && std::abs(way(hits[i], tracer) - way(expected[i], embree)) <= 1e-3 * size;
      else
        same &= !hits[i].valid() || tracer.resolve(hits[i]).placement->instance >= usual_count(usual);
      if (!same) ++differences;
    }
    EXPECT_LE(differences, kRays / 200) << tracer.name() << " " << tracer.isa();
  };
  for (const PackedIsa isa : test::isas()) check(PackedTracer(baked.file, baked.source, isa));
  check(EmbreeClusterTracer(baked.file, baked.source));
}

/// 20 small spheres around the origin.
void add_spheres(Scene& scene, double scale) {
  const uint32_t object = add_object(scene, test::sphere({0, 0, 0}, 1, 16));
  std::mt19937 generator(2);
  std::uniform_real_distribution<double> unit(-5.0, 5.0);
  for (int i = 0; i < 20; ++i) {
    const double x = unit(generator), y = unit(generator), z = unit(generator);
    const double side = i % 2 == 0 ? 1.0 : -1.0;
    scene.instances.push_back(
        {object, Affine(placed(DVec3(x, y, z) * scale, DVec3(side, 0.7, 1.0) * scale, 36.0 * i, {1, 2, 3}))});
  }
}

constexpr Region about(double size) { return {DVec3(-size), DVec3(size)}; }

Scene spheres() {
  Scene scene;
  add_spheres(scene, 1.0);
  return scene;
}

/// @param size half of the side; the diagonal passes below the middle of the scene
Mesh floor_of(float size) { return test::quad({-size, 0, -size}, {0, 0, 2 * size}, {2 * size, 0, 0}); }

TEST(ExtremeScenes, AFloorOfAnySizeLiesBelowWhatStandsOnIt) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  const auto standing_on = [](float size) {
    Scene scene;
    add_shape(scene, floor_of(size));
    add_spheres(scene, 1e-3);
    return scene;
  };
  for (const float size : {1e2f, 1e6f, 1e9f, 1e12f})
    expect_usual_hits(standing_on(10.0f), standing_on(size), about(6e-3), kRays / 2);
}

TEST(ExtremeScenes, AnInstanceFarAwayLeavesTheOthersWhereTheyAre) {
  for (const float distance : {1e6f, 1e15f, 1e30f}) {
    Scene scene = spheres();
    scene.instances.push_back({0, Affine(placed(DVec3(distance, -distance, 0.5 * distance)))});
    expect_usual_hits(spheres(), scene, about(6.0), kRays / 4);
  }
}

TEST(ExtremeScenes, TinyAndEnormousInstancesLieBesideOthers) {
  for (const double scale : {1e-20, 1e-12, 1e12, 1e20}) {
    Scene scene = spheres();
    scene.instances.push_back({0, Affine(placed({1, 1, 1}, DVec3(scale), 50))});
    expect_usual_hits(spheres(), scene, about(6.0), kRays / 4);
  }
}

TEST(ExtremeScenes, AGeometryOfAnySizeLiesBesideOthers) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  const auto above = [](float size) {
    Scene scene = spheres();
    scene.instances.push_back({add_object(scene, floor_of(size)), Affine(placed({0, -0.5, 0}))});
    return scene;
  };
  expect_usual_hits(spheres(), above(1e-30f), about(6.0), kRays / 4);
  for (const float size : {1e15f, 1e30f}) expect_usual_hits(above(1e4f), above(size), about(6.0), kRays / 2);
}

TEST(ExtremeScenes, ThingsWithoutAnExtentLieBesideOthers) {
  Scene scene = spheres();
  const uint32_t line = add_object(scene, test::quad({2, 2, 2}, {1, 1, 1}, {0, 0, 0}));
  const uint32_t point = add_object(scene, test::quad({1, 1, 1}, {0, 0, 0}, {0, 0, 0}));
  for (const uint32_t object : {line, point}) scene.instances.push_back({object, Affine(placed({3, 0, 0}))});
  for (const DVec3 scale : {DVec3(1, 0, 1), DVec3(0, 0, 1), DVec3(0)})
    scene.instances.push_back({0, Affine(placed({0, -50, 0}, scale))});
  expect_usual_hits(spheres(), scene, about(6.0), kRays / 4);
}

/// Mean number of placements entered and triangles tested per ray.
struct Work {
  double placements = 0.0, triangles = 0.0;
};

Work work_per_ray(const Scene& scene, double size) {
  const test::BakedScene baked(scene);
  const PackedTracer tracer(baked.file, baked.source);
  const std::vector<Ray> rays = rays_within(about(size), 5000, tracer.space());
  std::vector<RayHit> hits(rays.size());
  std::vector<uint8_t> occluded(rays.size());
  packed::KernelCounters counters;
  tracer.count_closest(rays, kCameraRays, hits, counters);
  tracer.count_any(rays, kOcclusionRays, occluded, counters);
  const auto count = static_cast<double>(counters.rays);
  return {static_cast<double>(counters.placements) / count, static_cast<double>(counters.triangles) / count};
}

TEST(ExtremeScenes, AnInstanceFarAwayDoesNotMakeRaysEnterAllOthers) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  Scene scene = test::thicket_scene();
  const double before = work_per_ray(scene, 6.0).placements;
  for (const double distance : {1e6, 1e9, 1e15}) {
    Scene far = scene;
    far.instances.push_back({0, Affine(placed({distance, 0, -distance}))});
    EXPECT_LT(work_per_ray(far, 6.0).placements, 1.1 * before) << distance;
  }
}

/// 2,000 small triangles in the box about(6).
Mesh splinters() {
  std::mt19937 generator(5);
  std::uniform_real_distribution<float> within(-6.0f, 6.0f), small(-0.05f, 0.05f);
  Mesh mesh;
  for (uint32_t i = 0; i < 2000; ++i) {
    const float x = within(generator), y = within(generator), z = within(generator);
    for (int corner = 0; corner < 3; ++corner) {
      const float dx = small(generator), dy = small(generator), dz = small(generator);
      mesh.positions.emplace_back(x + dx, y + dy, z + dz);
    }
    mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  return mesh;
}

/// Adds a floor of two triangles, which most rays within about(6) miss, to a mesh.
void add_floor(Mesh& mesh, float size) {
  const auto first = static_cast<uint32_t>(mesh.positions.size());
  for (const Vec3 corner : {Vec3(-1, 0, -1), Vec3(1, 0, -1), Vec3(1, 0, 1), Vec3(-1, 0, 1)})
    mesh.positions.push_back(corner * size + Vec3(0, -7, 0));
  mesh.triangles.emplace_back(first, first + 2, first + 1);
  mesh.triangles.emplace_back(first, first + 3, first + 2);
}

TEST(ExtremeScenes, HugeTrianglesDoNotMakeRaysTestAllSmallOnes) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  const auto scene_with = [](float size, bool apart) {
    Scene scene;
    Mesh mesh = splinters(), floor;
    add_floor(apart ? floor : mesh, size);
    add_shape(scene, mesh);
    if (apart) add_shape(scene, floor);
    return scene;
  };
  for (const bool apart : {true, false}) {
    const double before = work_per_ray(scene_with(10.0f, apart), 6.0).triangles;
    for (const float size : {1e4f, 1e6f})
      EXPECT_LT(work_per_ray(scene_with(size, apart), 6.0).triangles, 1.5 * before) << size;
    expect_usual_hits(scene_with(1e4f, apart), scene_with(1e6f, apart), about(5.0), kRays / 4);
  }
}

} // namespace
} // namespace packtrace
