// Rays that start on surfaces or have a limited range, instances that are pressed flat, many instances and none.

#include "runtime/trace/packed/scene/packed_tracer.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "runtime/trace/embree/embree_tracer.h"
#include "runtime/trace/packed/scene/tree_hull.h"
#include "runtime/trace/ray_offset.h"
#include "tests/runtime/trace/packed_scenes.h"
#include "tests/runtime/trace/test_scenes.h"

namespace packtrace {
namespace {

using test::add_object;
using test::add_shape;
using test::any;
using test::BakedScene;
using test::closest;
using test::isas;
using test::placed;
using test::quad;
using test::random_rays;
using test::varied_scene;

TEST(PackedTracer, RaysFromASurfaceDoNotHitIt) {
  Scene scene = varied_scene();
  scene.instances.pop_back(); // The distant instance would make the unit of length large.
  const BakedScene baked(scene);
  const PackedTracer tracer(baked.file, baked.source);
  const std::vector<Ray> rays = random_rays(100000, {{-9, -1, -9}, {9, 6, 9}}, tracer.space(), 8);
  const std::vector<RayHit> hits = closest(tracer, rays);
  std::vector<Ray> leaving;
  std::vector<double> offsets;
  for (size_t i = 0; i < rays.size(); ++i) {
    if (!hits[i].valid()) continue;
    const HitSurface hit = tracer.resolve(hits[i]);
    const DVec3 a(hit.vertices[0]), e = DVec3(hit.vertices[1]) - a, f = DVec3(hit.vertices[2]) - a;
    DVec3 n = hit.placement->surface_normal * glm::cross(e, f);
    if (!(glm::length(n) > 0.0)) continue;
    n = glm::normalize(n);
    if (glm::dot(n, DVec3(rays[i].direction)) > 0.0) n = -n;
    const DVec3 p =
        transform_point(hit.placement->unit_from_surface, a + e * double{hits[i].u} + f * double{hits[i].v});
    const double offset = ray_offset(hit, tracer.space(), p, n);
    Ray ray;
    ray.origin = Vec3(p + n * offset);
    ray.direction = Vec3(n);
    ray.tfar = static_cast<float>(8.0 * offset); // so short that only the surface itself can be hit
    leaving.push_back(ray);
    offsets.push_back(offset);
  }
  ASSERT_GT(leaving.size(), 20000u);
  size_t hit_again = 0;
  for (const uint8_t occluded : any(tracer, leaving)) hit_again += occluded;
  EXPECT_LE(hit_again, leaving.size() / 10000);
}

TEST(PackedTracer, KeepsToTheRangeOfT) {
  Scene scene;
  add_shape(scene, test::quad({-1, -1, 2}, {2, 0, 0}, {0, 2, 0}));
  add_shape(scene, test::quad({-1, -1, 4}, {2, 0, 0}, {0, 2, 0}));
  const BakedScene baked(scene);
  for (const PackedIsa isa : isas()) {
    const PackedTracer tracer(baked.file, baked.source, isa);
    Ray ray;
    ray.origin = Vec3(tracer.space().to_unit({0.1, 0.2, 0}));
    ray.direction = Vec3(0, 0, static_cast<float>(tracer.space().scale())); // t in world units
    const RayHit first = closest(tracer, {&ray, 1})[0];
    ASSERT_TRUE(first.valid());
    EXPECT_NEAR(first.t, 2.0f, 1e-5f);
    Ray beyond = ray;
    beyond.tnear = first.t; // The range of t is open at both ends.
    EXPECT_NEAR(closest(tracer, {&beyond, 1})[0].t, 4.0f, 1e-5f);
    Ray before = ray;
    before.tfar = first.t;
    EXPECT_FALSE(closest(tracer, {&before, 1})[0].valid());
    EXPECT_EQ(any(tracer, {&before, 1})[0], 0);
    for (const float tfar : {-1.0f, 0.0f, std::numeric_limits<float>::quiet_NaN()}) {
      Ray none = ray;
      none.tfar = tfar;
      EXPECT_EQ(any(tracer, {&none, 1})[0], 0);
    }
    Ray nowhere = ray;
    nowhere.direction = Vec3(0);
    EXPECT_EQ(any(tracer, {&nowhere, 1})[0], 0);
    nowhere.direction = Vec3(std::numeric_limits<float>::quiet_NaN());
    EXPECT_EQ(any(tracer, {&nowhere, 1})[0], 0);
    nowhere.direction = Vec3(0, 0, std::numeric_limits<float>::infinity());
    EXPECT_EQ(any(tracer, {&nowhere, 1})[0], 0);
  }
}

/// Instances that are flat, or nearly so, along various directions. Each is placed separately so that all are visible.
Scene flattened_scene() {
  Scene scene;
  add_object(scene, test::sphere({0, 0, 0}, 1, 24));
  const DVec3 scales[] = {{1, 0, 1}, {1, 1e-15, 1}, {1, -1e-12, 0.5}, {1e-10, 2, 1}, {1, 1, 0}};
  double x = 0.0;
  for (const DVec3 scale : scales)
    for (const double turn : {0.0, 40.0}) {
      scene.instances.push_back({0, Affine(placed({x, 1, 2}, scale, turn, {1, 2, 3}))});
      x += 5.0;
    }
  return scene;
}

TEST(PackedTracer, HitsInstancesThatArePressedFlat) {
  const Scene scene = flattened_scene();
  const BakedScene baked(scene);
  const EmbreeTracer embree(baked.source, {});
  const std::vector<Ray> rays = random_rays(20000, baked.source.world_bounds(), embree.space(), 3);
  const std::vector<RayHit> expected = closest(embree, rays);
  std::vector<uint32_t> hits(scene.instances.size());
  for (const PackedIsa isa : isas()) {
    const PackedTracer tracer(baked.file, baked.source, isa);
    EXPECT_TRUE(tracer.flat_instances().empty());
    ASSERT_EQ(tracer.space(), embree.space());
    const std::vector<RayHit> found = closest(tracer, rays);
    size_t differences = 0;
    for (size_t i = 0; i < rays.size(); ++i) {
      if (found[i].valid() != expected[i].valid()) ++differences;
      if (!found[i].valid() || !expected[i].valid()) continue;
      ++hits[tracer.resolve(found[i]).placement->instance];
      if (std::abs(found[i].t - expected[i].t) > 1e-5f) ++differences;
    }
    EXPECT_LE(differences, 5u) << tracer.isa(); // rays that pass close to an outline
  }
  for (const uint32_t count : hits) EXPECT_GT(count, 10u);
}

TEST(PackedTracer, NamesInstancesThatArePressedOntoALine) {
  Scene scene;
  add_object(scene, test::sphere({0, 0, 0}, 1, 8));
  scene.instances.push_back({0, Affine(placed({0, 0, 0}))});
  scene.instances.push_back({0, Affine(placed({4, 0, 0}, DVec3(1, 0, 0), 30, {1, 1, 1}))});
  scene.instances.push_back({0, Affine(placed({4, 0, 0}, DVec3(0)))});
  const BakedScene baked(scene);
  const PackedTracer tracer(baked.file, baked.source);
  ASSERT_EQ(tracer.flat_instances().size(), 2u);
  EXPECT_EQ(tracer.flat_instances()[0], 1u);
  EXPECT_EQ(tracer.flat_instances()[1], 2u);
}

TEST(TreeHull, IsCloserThanTheTurnedRootsBoxAndHoldsAllThatIsHit) {
  Scene scene;
  add_object(scene, test::sphere({0, 0, 0}, 1, 60));
  scene.instances.push_back({0, Affine(placed({0, 0, 0}))});
  const BakedScene baked(scene);
  const PackedTracer tracer(baked.file, baked.source);
  const TreeHull hull(tracer.trees()[0].nodes);
  const DAffine turned = placed({5, 6, 7}, {1, -2, 0.5}, 45, {1, 1, 0});
  const TreeBox box = hull.placed(turned);
  DVec3 lo(std::numeric_limits<double>::infinity()), hi = -lo; // bounds of the transformed corners of the root's box
  for (int corner = 0; corner < 8; ++corner) {
    const DVec3 at((corner & 1) != 0 ? hull.hi().x : hull.lo().x, (corner & 2) != 0 ? hull.hi().y : hull.lo().y,
                   (corner & 4) != 0 ? hull.hi().z : hull.lo().z);
    lo = glm::min(lo, transform_point(turned, at)), hi = glm::max(hi, transform_point(turned, at));
  }
  const DVec3 size = hi - lo;
  EXPECT_LT(box.half_area(), 0.75 * (size.x * size.y + size.y * size.z + size.z * size.x));
  size_t vertices = 0;
  for (const RayHit& hit : closest(tracer, random_rays(5000, baked.source.world_bounds(), tracer.space(), 4))) {
    if (!hit.valid()) continue;
    for (const Vec3& vertex : tracer.resolve(hit).vertices) {
      const DVec3 at = transform_point(turned, DVec3(vertex));
      ++vertices;
      for (int axis = 0; axis < 3; ++axis) {
        EXPECT_GE(at[axis], double{box.lo[static_cast<size_t>(axis)]});
        EXPECT_LE(at[axis], double{box.hi[static_cast<size_t>(axis)]});
      }
    }
  }
  EXPECT_GT(vertices, 3000u);
  // Rays in the grid have errors of up to 2^-22 of its largest coordinate, so boxes of unaligned trees are padded.
  const DVec3 far = glm::max(glm::abs(hull.lo()), glm::abs(hull.hi()));
  const double error = 0x1p-22 * std::max({far.x, far.y, far.z});
  const TreeBox padded = hull.placed(DAffine(1.0));
  const std::vector<TreeBox> parts = hull.placed_parts(DAffine(1.0), true); // without padding
  ASSERT_FALSE(parts.empty());
  for (const TreeBox& part : parts)
    for (size_t axis = 0; axis < 3; ++axis) {
      EXPECT_LE(double{padded.lo[axis]}, double{part.lo[axis]} - 2 * error);
      EXPECT_GE(double{padded.hi[axis]}, double{part.hi[axis]} + 2 * error);
    }
}

TEST(PackedTracer, TracesManyInstances) {
  Scene scene;
  add_object(scene, test::box({-0.3f, -0.3f, -0.3f}, {0.3f, 0.3f, 0.3f}));
  for (int x = 0; x < 60; ++x)
    for (int z = 0; z < 50; ++z)
      scene.instances.push_back({0, Affine(placed({double(x), 0, double(z)}, DVec3(1), 7.0 * x + 11.0 * z))});
  const BakedScene baked(scene);
  const PackedTracer tracer(baked.file, baked.source);
  std::vector<Ray> rays;
  for (int x = 0; x < 60; ++x)
    for (int z = 0; z < 50; ++z) {
      Ray& ray = rays.emplace_back();
      ray.origin = Vec3(tracer.space().to_unit({x + 0.01, 5, z + 0.02}));
      ray.direction = Vec3(0, -1, 0);
    }
  const std::vector<RayHit> hits = closest(tracer, rays);
  for (size_t i = 0; i < hits.size(); ++i) {
    ASSERT_TRUE(hits[i].valid());
    EXPECT_EQ(tracer.resolve(hits[i]).placement->instance, i);
  }
}

TEST(PackedTracer, TracesNothing) {
  const BakedScene baked{Scene{}};
  const PackedTracer tracer(baked.file, baked.source);
  EXPECT_EQ(any(tracer, std::vector<Ray>(100)), std::vector<uint8_t>(100, 0));
}

} // namespace
} // namespace packtrace
