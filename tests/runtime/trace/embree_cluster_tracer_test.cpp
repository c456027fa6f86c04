#include "tests/runtime/trace/embree_cluster_tracer.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include "tests/runtime/trace/packed_scenes.h"
#include "tests/runtime/trace/test_scenes.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

using test::any;
using test::BakedScene;
using test::closest;
using test::random_rays;

uint64_t part(const RayTracer& tracer, std::string_view name) {
  for (const ResidentPart& p : tracer.resident())
    if (p.name == name) return p.bytes;
  return 0;
}

/// Expects both tracers to find the same hits, bit for bit. Returns the number of rays that hit.
size_t same_hits(const RayTracer& a, const RayTracer& b, std::span<const Ray> rays, uint32_t ray_class) {
  const std::vector<RayHit> of_a = closest(a, rays, ray_class), of_b = closest(b, rays, ray_class);
  EXPECT_EQ(std::memcmp(of_a.data(), of_b.data(), rays.size() * sizeof(RayHit)), 0);
  EXPECT_EQ(any(a, rays, ray_class), any(b, rays, ray_class));
  return static_cast<size_t>(std::count_if(of_a.begin(), of_a.end(), [](const RayHit& hit) { return hit.valid(); }));
}

TEST(EmbreeClusterTracer, FindsWhatPackedFindsToTheBit) {
  const BakedScene baked(test::varied_scene());
  for (const PackedIsa isa : test::isas()) {
    const PackedTracer packed(baked.file, baked.source, isa);
    const std::vector<Ray> rays = random_rays(test::fewer(100000u), {{-9, -1, -9}, {9, 6, 9}}, packed.space());
    for (const ClusterPrimitives primitives : {ClusterPrimitives::kClusters, ClusterPrimitives::kLeafNodes}) {
      const EmbreeClusterTracer clusters(baked.file, baked.source, isa, primitives);
      ASSERT_EQ(clusters.isa(), packed.isa());
      for (const uint32_t ray_class : {kCameraRays, kOcclusionRays})
        EXPECT_GT(same_hits(clusters, packed, rays, ray_class), test::fewer(15000u));
    }
  }
}

/// A single tree without a tree over placements; some rays lie in planes of the axes and of box faces.
TEST(EmbreeClusterTracer, FindsWhatPackedFindsAlongAxes) {
  Scene scene;
  test::add_shape(scene, test::sphere({0, 0, 0}, 1, 60));
  test::add_shape(scene, test::box({-2, -2, -2}, {-1, 2, 2}));
  const BakedScene baked(scene);
  const PackedTracer packed(baked.file, baked.source);
  const EmbreeClusterTracer clusters(baked.file, baked.source);
  std::vector<Ray> rays = random_rays(60000, {{-2, -2, -2}, {1, 2, 2}}, packed.space(), 3);
  for (size_t i = 0; i < rays.size(); ++i) {
    const int axis = static_cast<int>(i % 3);
    if (i % 2 == 0) rays[i].direction[axis] = 0.0f;
    if (i % 4 == 0) rays[i].direction[(axis + 1) % 3] = -0.0f;
    if (i % 8 == 0) rays[i].origin[axis] = std::round(rays[i].origin[axis] * 4.0f) / 4.0f;
    if (i % 5 == 0) rays[i].tfar = 0.7f, rays[i].tnear = 0.2f;
  }
  EXPECT_GT(same_hits(clusters, packed, rays, kCameraRays), 15000u);
}

TEST(EmbreeClusterTracer, ResolvesAsPackedDoes) {
  const BakedScene baked(test::varied_scene());
  const PackedTracer packed(baked.file, baked.source);
  const EmbreeClusterTracer clusters(baked.file, baked.source);
  for (const RayHit& hit : closest(clusters, random_rays(2000, {{-9, -1, -9}, {9, 6, 9}}, packed.space(), 8))) {
    if (!hit.valid()) continue;
    const HitSurface a = clusters.resolve(hit), b = packed.resolve(hit);
    EXPECT_EQ(a.placement->instance, b.placement->instance);
    EXPECT_EQ(a.geometry, b.geometry);
    EXPECT_EQ(a.triangle, b.triangle);
    EXPECT_EQ(std::memcmp(a.vertices, b.vertices, sizeof a.vertices), 0);
  }
}

TEST(EmbreeClusterTracer, FindsTheSameOnAllThreads) {
  const BakedScene baked(test::varied_scene());
  const EmbreeClusterTracer tracer(baked.file, baked.source);
  const std::vector<Ray> rays = random_rays(test::fewer(40000u), {{-9, -1, -9}, {9, 6, 9}}, tracer.space(), 6);
  const std::vector<RayHit> expected = closest(tracer, rays);
  std::vector<RayHit> hits(rays.size());
  tbb::parallel_for(size_t{0}, rays.size() / 100, [&](size_t i) {
    tracer.closest_hits({&rays[i * 100], 100}, kCameraRays, RayOrder::kCoherent, {&hits[i * 100], 100});
  });
  EXPECT_EQ(std::memcmp(hits.data(), expected.data(), rays.size() * sizeof(RayHit)), 0);
}

TEST(EmbreeClusterTracer, TellsWhatItHolds) {
  Scene scene;
  test::add_shape(scene, test::sphere({0, 0, 0}, 1, 200));
  const BakedScene baked(scene);
  const EmbreeClusterTracer tracer(baked.file, baked.source);
  const uint64_t clusters = baked.file.sections().clusters.size();
  EXPECT_EQ(part(tracer, "file"), baked.file.file_bytes());
  EXPECT_GE(part(tracer, "bvh"), clusters * 8);
  EXPECT_GT(part(tracer, "cluster nodes"), clusters * 8);
}

TEST(EmbreeClusterTracer, TracesNothing) {
  const BakedScene baked{Scene{}};
  const EmbreeClusterTracer tracer(baked.file, baked.source);
  EXPECT_EQ(any(tracer, std::vector<Ray>(100)), std::vector<uint8_t>(100, 0));
}

} // namespace
} // namespace packtrace
