#include "runtime/trace/packed/scene/packed_tracer.h"

#include <algorithm>
#include <cstring>

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include "runtime/trace/embree/embree_tracer.h"
#include "tests/runtime/trace/packed_scenes.h"
#include "tests/runtime/trace/test_scenes.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

using test::add_object;
using test::add_shape;
using test::any;
using test::BakedScene;
using test::closest;
using test::cone;
using test::isas;
using test::placed;
using test::quad;
using test::random_rays;
using test::thicket_scene;
using test::varied_scene;

struct Difference {
  size_t hits = 0, yes_no = 0, distance = 0;
  double worst = 0.0; ///< largest relative difference of t among the other hits
};

Difference difference(const RayTracer& a, const RayTracer& b, std::span<const Ray> rays, uint32_t ray_class) {
  const std::vector<RayHit> of_a = closest(a, rays, ray_class), of_b = closest(b, rays, ray_class);
  const std::vector<uint8_t> any_a = any(a, rays, ray_class);
  Difference result;
  for (size_t i = 0; i < rays.size(); ++i) {
    EXPECT_EQ(any_a[i] != 0, of_a[i].valid()) << "ray " << i;
    result.hits += of_a[i].valid();
    if (of_a[i].valid() != of_b[i].valid()) {
      ++result.yes_no;
    } else if (of_a[i].valid()) {
      const double relative = std::abs(double{of_a[i].t} - of_b[i].t) / std::abs(double{of_b[i].t});
      if (relative > 1e-3)
        ++result.distance;
      else
        result.worst = std::max(result.worst, relative);
    }
  }
  return result;
}

TEST(PackedTracer, FindsWhatEmbreeFinds) {
  const BakedScene baked(varied_scene());
  const EmbreeTracer embree(baked.source, {});
  const PackedTracer packed(baked.file, baked.source);
  ASSERT_EQ(embree.space().scale(), packed.space().scale());
  const Bounds near{{-9, -1, -9}, {9, 6, 9}};
  const std::vector<Ray> rays = random_rays(test::fewer(200000u), near, packed.space());
  for (const uint32_t ray_class : {kCameraRays, kOcclusionRays}) {
    const Difference d = difference(packed, embree, rays, ray_class);
    EXPECT_GT(d.hits, test::fewer(30000u));
    EXPECT_LE(d.yes_no, 4u); // Float matrices displace Embree's instances; one lies 3000 units away.
    EXPECT_LE(d.distance, 4u);
    EXPECT_LT(d.worst, 1e-3);
  }
}

TEST(PackedTracer, FindsTheSameWithAllInstructionSets) {
  const BakedScene baked(varied_scene());
  const PackedTracer truth(baked.file, baked.source, PackedIsa::kScalar);
  const std::vector<Ray> rays = random_rays(test::fewer(30000u), {{-9, -1, -9}, {9, 6, 9}}, truth.space(), 5);
  const std::vector<RayHit> expected = closest(truth, rays);
  const std::vector<uint8_t> occluded = any(truth, rays);
  for (const PackedIsa isa : isas()) {
    const PackedTracer tracer(baked.file, baked.source, isa);
    EXPECT_EQ(std::memcmp(closest(tracer, rays).data(), expected.data(), rays.size() * sizeof(RayHit)), 0);
    EXPECT_EQ(any(tracer, rays), occluded);
  }
}

TEST(PackedTracer, BeamsFindWhatTheirRaysFind) {
  const BakedScene baked(varied_scene());
  for (const PackedIsa isa : isas()) {
    const PackedTracer tracer(baked.file, baked.source, isa);
    size_t hits = 0;
    for (const DVec3& from : {DVec3(0, 2, -7), DVec3(-2.5, 1, 0), DVec3(6, 3, 6)})
      for (const DVec3& towards : {DVec3(0, 0, 1), DVec3(-0.6, -0.2, -0.7), DVec3(0.5, -0.5, 0.5)})
        for (const double width : {0.05, 0.5, 3.0}) {
          if (test::sanitized() && width != 0.5) continue;
          const std::vector<Ray> rays = cone(tracer.space(), from, towards, width);
          const std::vector<RayHit> together = closest(tracer, rays);
          std::vector<RayHit> alone(rays.size());
          const size_t step = test::sanitized() ? 13 : 1; // of the rays that are traced alone, too
          for (size_t i = 0; i < rays.size(); i += step) {
            tracer.closest_hits({&rays[i], 1}, kCameraRays, RayOrder::kCoherent, {&alone[i], 1});
            EXPECT_EQ(std::memcmp(&together[i], &alone[i], sizeof(RayHit)), 0) << tracer.isa() << " ray " << i;
            hits += alone[i].valid();
          }
        }
    EXPECT_GT(hits, test::sanitized() ? 10000u / 13 : 30000u);
  }
}

TEST(PackedTracer, RaysAmongManyInstancesFindTogetherWhatTheyFindAlone) {
  const BakedScene baked(thicket_scene());
  const PackedTracer alone(baked.file, baked.source, PackedIsa::kScalar);
  const size_t count = test::sanitized() ? 2000 : 10000;
  std::vector<Ray> rays = random_rays(count, {{-6, 0, -6}, {6, 4, 6}}, alone.space(), 8);
  for (size_t i = 0; i < rays.size(); i += 3) rays[i].tnear = 0.2f, rays[i].tfar = i % 2 == 0 ? 0.6f : 0.1f;
  for (const uint32_t ray_class : {kCameraRays, kOcclusionRays}) {
    std::vector<RayHit> hits(rays.size());
    std::vector<uint8_t> occluded(rays.size());
    size_t hit = 0;
    for (size_t i = 0; i < rays.size(); ++i) {
      alone.closest_hits({&rays[i], 1}, ray_class, RayOrder::kIncoherent, {&hits[i], 1});
      alone.any_hits({&rays[i], 1}, ray_class, RayOrder::kIncoherent, {&occluded[i], 1});
      ASSERT_EQ(occluded[i] != 0, hits[i].valid());
      hit += hits[i].valid();
    }
    EXPECT_GT(hit, 3 * count / 10);
    EXPECT_LT(hit, 8 * count / 10);
    for (const PackedIsa isa : isas()) {
      const PackedTracer together(baked.file, baked.source, isa);
      EXPECT_EQ(std::memcmp(closest(together, rays, ray_class).data(), hits.data(), rays.size() * sizeof(RayHit)), 0);
      EXPECT_EQ(any(together, rays, ray_class), occluded);
      packed::KernelCounters all, portions; // Rays share node visits only if they are traced together.
      std::vector<uint8_t> counted(rays.size());
      together.count_any(rays, ray_class, counted, all);
      EXPECT_EQ(counted, occluded);
      for (size_t at = 0; at < rays.size(); at += 250)
        together.count_any({&rays[at], 250}, ray_class, {&counted[at], 250}, portions);
      EXPECT_EQ(counted, occluded);
      EXPECT_LT(2 * all.nodes, portions.nodes);
    }
  }
}

TEST(PackedTracer, RaysOfAllOctantsFillAPortion) {
  const BakedScene baked(thicket_scene());
  const PackedTracer tracer(baked.file, baked.source);
  std::vector<Ray> rays = random_rays(4096, {{-6, 0, -6}, {6, 4, 6}}, tracer.space(), 9);
  for (uint32_t i = 0; i < rays.size(); ++i) // the maximum number of groups of 64: all but seven have the same octant
    for (int axis = 0; axis < 3; ++axis)
      rays[i].direction[axis] =
          std::copysign(rays[i].direction[axis], i % 512 == 511 && (i / 512 >> axis & 1u) != 0 ? -1.0f : 1.0f);
  const std::vector<RayHit> together = closest(tracer, rays);
  const std::vector<uint8_t> occluded = any(tracer, rays, kCameraRays);
  size_t hits = 0;
  for (size_t i = 0; i < rays.size(); ++i) {
    RayHit hit;
    tracer.closest_hits({&rays[i], 1}, kCameraRays, RayOrder::kIncoherent, {&hit, 1});
    ASSERT_EQ(std::memcmp(&hit, &together[i], sizeof hit), 0) << i;
    ASSERT_EQ(hit.valid(), occluded[i] != 0) << i;
    hits += hit.valid();
  }
  EXPECT_GT(hits, 500u);
}

TEST(PackedTracer, TracersOfMoreAndLessDeepTreesTakeTurnsOnAThread) {
  Scene few = varied_scene(); // nine placements: a tree of two levels
  for (int i = 0; i < 3; ++i) few.instances.push_back({0, Affine(placed({i, 2, -i}, DVec3(0.5), 10 * i))});
  const BakedScene shallow(few), deep(thicket_scene());
  for (const BakedScene* scene : {&shallow, &deep, &shallow, &deep}) {
    const PackedTracer tracer(scene->file, scene->source);
    const std::vector<Ray> rays = random_rays(2000, {{-6, 0, -6}, {6, 4, 6}}, tracer.space(), 10);
    const std::vector<RayHit> together = closest(tracer, rays);
    for (size_t i = 0; i < rays.size(); i += 20) {
      RayHit hit;
      tracer.closest_hits({&rays[i], 1}, kCameraRays, RayOrder::kIncoherent, {&hit, 1});
      ASSERT_EQ(std::memcmp(&hit, &together[i], sizeof hit), 0) << i;
    }
  }
}

/// Instances with coplanar overlapping faces, whose boxes rays enter in another order.
Scene coinciding_scene() {
  Scene scene;
  for (const float depth : {0.5f, 2.0f, -1.0f}) {
    Mesh mesh = quad({-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
    const Mesh fin = quad({depth, -1, 0}, {0, 0.5f, 0}, {0, 0, depth});
    for (const auto& triangle : fin.triangles)
      mesh.triangles.push_back(triangle + static_cast<uint32_t>(mesh.positions.size()));
    mesh.positions.insert(mesh.positions.end(), fin.positions.begin(), fin.positions.end());
    add_object(scene, mesh);
  }
  for (uint32_t i = 0; i < 24; ++i)
    scene.instances.push_back({i % 3, Affine(placed({0.11 * i, 0.07 * (i % 5), 0}, DVec3(1 + i % 2), 0))});
  return scene;
}

TEST(PackedTracer, OfCoincidingSurfacesTheSameIsHitHoweverRaysCome) {
  const BakedScene baked(coinciding_scene());
  for (const PackedIsa isa : isas()) {
    const PackedTracer tracer(baked.file, baked.source, isa);
    std::mt19937 generator(3);
    std::uniform_real_distribution<double> along(-0.8, 2.5);
    std::vector<Ray> rays(test::fewer(4000u));
    for (Ray& ray : rays) { // far enough away that origins are moved to the trees
      const DVec3 to = tracer.space().to_unit({along(generator), along(generator), 0});
      const DVec3 from = tracer.space().to_unit({9 * along(generator), 9 * along(generator), 100});
      ray.origin = Vec3(from), ray.direction = Vec3(to - from);
    }
    const std::vector<RayHit> together = closest(tracer, rays);
    EXPECT_GT(std::ranges::count_if(together, [](const RayHit& hit) { return hit.valid(); }), test::fewer(2500));
    for (const size_t portion : {1u, 7u, 300u}) {
      std::vector<RayHit> hits(rays.size());
      for (size_t at = 0; at < rays.size(); at += portion) {
        const size_t count = std::min(portion, rays.size() - at);
        tracer.closest_hits({&rays[at], count}, kCameraRays, RayOrder::kCoherent, {&hits[at], count});
      }
      EXPECT_EQ(std::memcmp(hits.data(), together.data(), rays.size() * sizeof(RayHit)), 0) << tracer.isa() << portion;
    }
  }
}

TEST(PackedTracer, FindsTheSameOnAllThreadsAndInAnyPortions) {
  const BakedScene baked(varied_scene());
  const PackedTracer tracer(baked.file, baked.source);
  const std::vector<Ray> rays = random_rays(50000, {{-9, -1, -9}, {9, 6, 9}}, tracer.space(), 6);
  const std::vector<RayHit> expected = closest(tracer, rays);
  std::vector<RayHit> hits(rays.size());
  tbb::parallel_for(size_t{0}, rays.size() / 50, [&](size_t portion) {
    for (size_t at = portion * 50; at < portion * 50 + 50;) { // 1, 2, 3, ... rays per call
      const size_t count = std::min(at % 50 + 1, portion * 50 + 50 - at);
      tracer.closest_hits({&rays[at], count}, kCameraRays, RayOrder::kCoherent, {&hits[at], count});
      at += count;
    }
  });
  EXPECT_EQ(std::memcmp(hits.data(), expected.data(), rays.size() * sizeof(RayHit)), 0);
}

/// Returns the t of the nearest hit, tested against all triangles in doubles by Cramer's rule in world space.
double brute_force(const SceneSource& source, const std::vector<std::vector<DVec3>>& corners, const UnitSpace& space,
                   const Ray& ray) {
  const DVec3 o = space.from_unit(DVec3(ray.origin)), d = DVec3(ray.direction) / space.scale();
  double nearest = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < source.instances().size(); ++i)
    for (size_t c = 0; c < corners[i].size(); c += 3) {
      const DVec3 a = corners[i][c], e = corners[i][c + 1] - a, f = corners[i][c + 2] - a;
      const DVec3 p = glm::cross(d, f), s = o - a, q = glm::cross(s, e);
      const double det = glm::dot(e, p), u = glm::dot(s, p) / det, v = glm::dot(d, q) / det;
      const double t = glm::dot(f, q) / det;
      if (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > ray.tnear && t < ray.tfar) nearest = std::min(nearest, t);
    }
  return nearest;
}

TEST(PackedTracer, FindsWhatTryingAllTrianglesFinds) {
  Scene scene;
  add_shape(scene, test::sphere({0, 1, 0}, 1, 12));
  add_shape(scene, test::quad({-3, 0, -3}, {0, 0, 6}, {6, 0, 0}));
  add_object(scene, test::box({-0.5f, -0.5f, -0.5f}, {0.5f, 0.5f, 0.5f}));
  scene.instances.push_back({0, Affine(placed({2, 1, 0}, DVec3(1, -2, 0.5), 30, {1, 2, 3}))});
  scene.instances.push_back({0, Affine(placed({-2, 1, 0}, DVec3(0.3), 50, {0, 0, 1}))});
  const BakedScene baked(scene);
  const PackedTracer tracer(baked.file, baked.source);
  std::vector<std::vector<DVec3>> corners;
  for (const PlacedGeometry& placed_geometry : baked.source.instances()) {
    const GeometryCounts counts = baked.source.counts(placed_geometry.geometry);
    std::vector<Vec3> positions(counts.vertices);
    std::vector<Triangle> triangles(counts.triangles);
    baked.source.decode(placed_geometry.geometry, positions, triangles);
    corners.emplace_back();
    for (const Triangle& t : triangles)
      for (int i = 0; i < 3; ++i)
        corners.back().push_back(transform_point(DAffine(placed_geometry.world_from_object), DVec3(positions[t[i]])));
  }
  std::vector<Ray> rays = random_rays(20000, baked.source.world_bounds(), tracer.space(), 9);
  for (size_t i = 0; i < rays.size(); i += 3) rays[i].tnear = 0.2f, rays[i].tfar = 0.6f;
  const std::vector<RayHit> hits = closest(tracer, rays);
  size_t found = 0, different = 0;
  for (size_t i = 0; i < rays.size(); ++i) {
    const double t = brute_force(baked.source, corners, tracer.space(), rays[i]);
    found += hits[i].valid();
    different += hits[i].valid() != std::isfinite(t) || (hits[i].valid() && std::abs(hits[i].t - t) > 1e-5);
  }
  EXPECT_GT(found, 3000u);
  EXPECT_LE(different, 2u); // rays so close to an edge that rounding decides
}

TEST(PackedTracer, SaysWhatAHitIs) {
  const BakedScene baked(varied_scene());
  const PackedTracer tracer(baked.file, baked.source);
  const std::vector<Ray> rays = random_rays(5000, {{-9, -1, -9}, {9, 6, 9}}, tracer.space(), 7);
  const std::vector<RayHit> hits = closest(tracer, rays);
  size_t count = 0;
  for (size_t i = 0; i < rays.size(); ++i) {
    if (!hits[i].valid()) continue;
    const HitSurface surface = tracer.resolve(hits[i]);
    const PlacedGeometry& instance = baked.source.instances()[surface.placement->instance];
    ASSERT_EQ(instance.geometry, surface.geometry);
    const GeometryCounts counts = baked.source.counts(surface.geometry);
    std::vector<Vec3> positions(counts.vertices);
    std::vector<Triangle> triangles(counts.triangles);
    baked.source.decode(surface.geometry, positions, triangles);
    DVec3 point(0.0);
    const double weights[] = {1.0 - double{hits[i].u} - hits[i].v, hits[i].u, hits[i].v};
    const DVec3 on_ray = DVec3(rays[i].origin) + DVec3(rays[i].direction) * double{hits[i].t};
    const double size = UnitSpace::kHalfSize;
    for (int corner = 0; corner < 3; ++corner) {
      const DVec3 in_unit = transform_point(surface.placement->unit_from_surface, DVec3(surface.vertices[corner]));
      const DVec3 in_world =
          transform_point(DAffine(instance.world_from_object), DVec3(positions[triangles[surface.triangle][corner]]));
      EXPECT_LT(glm::distance(in_unit, tracer.space().to_unit(in_world)), 1e-6 * size);
      point += in_unit * weights[corner];
    }
    EXPECT_LT(glm::distance(point, on_ray), 1e-6 * size);
    ++count;
  }
  EXPECT_GT(count, 800u);
}

} // namespace
} // namespace packtrace
