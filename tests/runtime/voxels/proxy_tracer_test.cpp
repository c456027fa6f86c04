#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "compress/format/file/baked_file.h"
#include "runtime/trace/source/packed_source.h"
#include "runtime/voxels/proxy_tracer.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

/// Balls of radius 1 in a row away from the eye.
BakedFile row_of_balls(uint32_t count, bool trees = true) {
  Scene scene;
  scene.materials.emplace_back();
  scene.meshes.push_back(test::sphere_mesh(30));
  scene.objects.push_back({"ball", {Shape{0, 0, false, DAffine(1.0)}}});
  for (uint32_t i = 0; i < count; ++i)
    scene.instances.push_back({0, Affine(test::translation(DVec3(i % 3, 0.0, 6.0 * (i + 1))))});
  BakeConfig config;
  config.trees = trees;
  config.proxy.use = ProxyUse::kVoxels, config.proxy.voxels = 24;
  return BakedFile::from_bytes(test::bake(scene, config).bytes);
}

/// Every query equals the nearer of the triangles of large instances and the voxels of small ones.
void compare(Backend backend, uint32_t first_small) {
  const BakedFile file = row_of_balls(30);
  const PackedSource source(file);
  std::vector<uint32_t> small;
  for (uint32_t i = first_small; i < 30; ++i) small.push_back(i);
  TracerConfig config;
  config.backend = backend;
  const std::unique_ptr<RayTracer> whole = make_tracer(source, &file, config);
  const ProxyTracer tracer(*whole, file, source, small, config);
  const VoxelScene voxels(file, [&](uint32_t i) { return i >= first_small; });
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  uint32_t of_voxels = 0, of_triangles = 0;
  for (int n = 0; n < 4000; ++n) {
    const DVec3 origin =
        DVec3(8.0 * unit(random) - 3.0, 4.0 * unit(random) - 2.0, 190.0 * unit(random)) - file.origin();
    const DVec3 aim(unit(random) - 0.5, unit(random) - 0.5, unit(random) - 0.5), direction = glm::normalize(aim);
    const auto ray_in = [&](const UnitSpace& space) {
      Ray ray;
      ray.origin = Vec3(space.to_unit(origin)), ray.tfar = 40.0f;
      ray.direction = Vec3(direction / space.inverse_scale());
      return ray;
    };
    // Triangles of small instances do not count: rays pass them one after another.
    float expected = 40.0f;
    Ray rest = ray_in(whole->space());
    for (RayHit hit; rest.tnear < 40.0f; rest.tnear = hit.t * 1.00001f) {
      whole->closest_hits({&rest, 1}, kOcclusionRays, RayOrder::kIncoherent, {&hit, 1});
      if (!hit.valid()) break;
      if (whole->resolve(hit).placement->instance >= first_small) continue;
      expected = hit.t;
      break;
    }
    const bool by_triangle = expected < 40.0f;
    const double at = voxels.first_distance(origin, direction, 0.0, double{expected});
    const Ray ray = ray_in(tracer.space());
    RayHit hit;
    uint8_t occluded = 2;
    tracer.closest_hits({&ray, 1}, kOcclusionRays, RayOrder::kIncoherent, {&hit, 1});
    tracer.any_hits({&ray, 1}, kOcclusionRays, RayOrder::kIncoherent, {&occluded, 1});
    ASSERT_EQ(occluded, at < 40.0 ? 1 : 0) << n;
    ASSERT_EQ(hit.valid(), at < 40.0) << n;
    ASSERT_TRUE(!hit.valid() || std::abs(double{hit.t} - at) < 1e-3) << n;
    (at < double{expected} ? of_voxels : of_triangles) += at < double{expected} || by_triangle ? 1 : 0;
  }
  EXPECT_GT(of_voxels, 100u);
  EXPECT_EQ(of_triangles > 100, first_small > 0);
}

TEST(ProxyTracer, RaysSeeTrianglesOfLargeInstancesAndVoxelsOfSmallOnes) {
  compare(Backend::kPacked, 15);
  compare(Backend::kEmbree, 15);
}

TEST(ProxyTracer, AllInstancesMayBeSmall) {
  compare(Backend::kPacked, 0);
  compare(Backend::kEmbree, 0);
}

uint64_t bytes_of(const RayTracer& tracer, std::string_view name) {
  for (const ResidentPart& part : tracer.resident())
    if (part.name == name) return part.bytes;
  ADD_FAILURE() << name;
  return 0;
}

TEST(ProxyTracer, InstancesSeenAsVoxelsTakeNoPlacements) {
  const BakedFile file = row_of_balls(300);
  const PackedSource source(file);
  std::vector<uint32_t> small;
  for (uint32_t i = 20; i < 300; ++i) small.push_back(i);
  TracerConfig config;
  config.backend = Backend::kPacked;
  const std::unique_ptr<RayTracer> whole = make_tracer(source, &file, config);
  const ProxyTracer tracer(*whole, file, source, small, config);
  EXPECT_LT(bytes_of(tracer, "placements"), bytes_of(*whole, "placements") / 5);
}

TEST(ProxyTracer, TreesAndClustersAreThoseOfTheWholeTracer) {
  const BakedFile file = row_of_balls(8, false);
  ASSERT_TRUE(file.sections().trees.empty()); // both tracers would have to build them
  const PackedSource source(file);
  TracerConfig config;
  config.backend = Backend::kPacked;
  std::unique_ptr<RayTracer> whole = make_tracer(source, &file, config);
  ASSERT_GT(bytes_of(*whole, "nodes built"), 0u);
  const ProxyTracer tracer(*whole, file, source, {3, 4, 5, 6, 7}, config);
  EXPECT_EQ(bytes_of(tracer, "nodes built"), 0u);
  EXPECT_EQ(bytes_of(tracer, "cluster table"), 0u);
  Ray ray;
  ray.origin = Vec3(tracer.space().to_unit(DVec3(0.1, 0.1, 0.0) - file.origin())), ray.tfar = 100.0f;
  ray.direction = Vec3(DVec3(0, 0, 1) / tracer.space().inverse_scale());
  RayHit with, without;
  tracer.closest_hits({&ray, 1}, kOcclusionRays, RayOrder::kIncoherent, {&with, 1});
  whole.reset(); // the shared trees stay
  tracer.closest_hits({&ray, 1}, kOcclusionRays, RayOrder::kIncoherent, {&without, 1});
  EXPECT_TRUE(with.valid());
  EXPECT_EQ(with.t, without.t);
}

} // namespace
} // namespace packtrace
