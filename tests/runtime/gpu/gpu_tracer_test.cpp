// The GPU finds the packed tracer's hits, bit for bit. On Mesa's CPU device this takes about 10 us a ray.

#include "runtime/trace/gpu/gpu_tracer.h"

#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include "runtime/camera/lod_view.h"
#include "runtime/trace/make_tracer.h"
#include "runtime/trace/packed/scene/placed_trees.h"
#include "tests/runtime/gpu/gpu_test_device.h"
#include "tests/runtime/trace/packed_scenes.h"

namespace packtrace {
namespace {

using test::add_object;
using test::add_shape;
using test::placed;

constexpr size_t kRays = 4000;

bool same_hit(const RayHit& a, const RayHit& b) {
  return std::memcmp(&a.t, &b.t, sizeof a.t) == 0 && a.placement == b.placement && a.part == b.part &&
         a.triangle == b.triangle;
}

/// Weights come from sums that doubles may round differently; a few ulp is what masks and shading see of it.
bool same_weights(const RayHit& a, const RayHit& b) {
  return std::abs(a.u - b.u) <= 1e-6f && std::abs(a.v - b.v) <= 1e-6f;
}

class GpuTracerTest : public test::OnGpu {
protected:
  /// Compares all hits of some rays of both classes.
  /// @param least_hits of the camera rays
  void expect_same(const GpuTracer& tracer, std::span<const Ray> rays, size_t least_hits) {
    for (const uint32_t ray_class : {kCameraRays, kOcclusionRays}) {
      const std::vector<RayHit> expected = test::closest(tracer.packed(), rays, ray_class),
                                hits = test::closest(tracer, rays, ray_class);
      const std::vector<uint8_t> occluded = test::any(tracer, rays, ray_class);
      size_t different = 0, weights = 0, any = 0, found = 0;
      for (size_t i = 0; i < rays.size(); ++i) {
        found += expected[i].valid() ? 1 : 0;
        different += same_hit(hits[i], expected[i]) ? 0 : 1;
        weights += same_weights(hits[i], expected[i]) ? 0 : 1;
        any += (occluded[i] != 0) == expected[i].valid() ? 0 : 1;
      }
      EXPECT_EQ(different, 0u) << "nearest hits, class " << ray_class;
      EXPECT_EQ(weights, 0u) << "weights, class " << ray_class;
      EXPECT_EQ(any, 0u) << "any hits, class " << ray_class;
      if (ray_class == kCameraRays) {
        EXPECT_GE(found, least_hits);
      }
    }
    expect_no_messages(tracer);
  }

  void expect_same(const Scene& scene, size_t least_hits) {
    const test::BakedScene baked(scene);
    const GpuTracer tracer(baked.file, baked.source, config_);
    expect_same(tracer, test::random_rays(kRays, baked.source.world_bounds(), tracer.space()), least_hits);
  }

  static void expect_no_messages(const GpuTracer& tracer) {
    for (const std::string& message : tracer.scene().validation_messages()) ADD_FAILURE() << message;
  }
};

Scene sphere_scene(double scale = 1.0) {
  Scene scene;
  add_shape(scene, test::sphere({0, 0, 0}, 1, 48), 0, placed(DVec3(0), DVec3(scale)));
  return scene;
}

TEST_F(GpuTracerTest, OnePlacement) { expect_same(sphere_scene(), kRays / 10); }

TEST_F(GpuTracerTest, SixPlacementsWithMasks) { expect_same(test::varied_scene(), 5); }

TEST_F(GpuTracerTest, ManyPlacements) { expect_same(test::thicket_scene(), 5); }

TEST_F(GpuTracerTest, RaysNearTheObjects) {
  const test::BakedScene baked(test::thicket_scene());
  const GpuTracer tracer(baked.file, baked.source, config_);
  Bounds near;
  near.extend(DVec3(-8, -0.5, -8)), near.extend(DVec3(8, 5, 8));
  expect_same(tracer, test::random_rays(2 * kRays, near, tracer.space(), 3), kRays / 2);
}

TEST_F(GpuTracerTest, ScalesOfTheWorld) {
  for (const double scale : {1e-30, 1e-6, 1e6, 1e30}) expect_same(sphere_scene(scale), kRays / 10);
}

/// Grids of 2^22 and more steps: sheared corners near edges are computed in doubles, and vertex differences are not
/// exact in floats.
TEST_F(GpuTracerTest, FineGrids) {
  BakeConfig config;
  config.precision_kind = PrecisionKind::kPositionBits;
  config.precision = 27;
  const test::BakedScene baked(sphere_scene(), config);
  const GpuTracer tracer(baked.file, baked.source, config_);
  EXPECT_GT(tracer.packed().trees()[0].max_coordinate, 0x1p21f);
  expect_same(tracer, test::random_rays(kRays, baked.source.world_bounds(), tracer.space()), kRays / 10);
}

/// A huge triangle among small ones makes the tree graded.
TEST_F(GpuTracerTest, GradedTrees) {
  Scene scene = sphere_scene();
  add_shape(scene, test::quad({-3e6f, -2, -3e6f}, {0, 0, 6e6f}, {6e6f, 0, 0}));
  BakeConfig config;
  config.precision_kind = PrecisionKind::kEdgeFraction;
  config.precision = 1e-3;
  const test::BakedScene baked(scene, config);
  const GpuTracer tracer(baked.file, baked.source, config_);
  size_t graded = 0;
  for (const packed::TraceTree& tree : tracer.packed().trees()) graded += tree.graded;
  EXPECT_GT(graded, 0u);
  Bounds near;
  near.extend(DVec3(-2)), near.extend(DVec3(2));
  expect_same(tracer, test::random_rays(kRays, near, tracer.space()), kRays / 10);
}

TEST_F(GpuTracerTest, FarOrigins) {
  const test::BakedScene baked(test::varied_scene());
  const GpuTracer tracer(baked.file, baked.source, config_);
  Bounds near;
  near.extend(DVec3(-8, -0.5, -8)), near.extend(DVec3(8, 5, 8));
  std::vector<Ray> rays = test::random_rays(kRays, near, tracer.space());
  for (size_t i = 0; i < rays.size(); ++i) rays[i].origin -= rays[i].direction * std::ldexp(1.0f, int(i % 40));
  expect_same(tracer, rays, 100);
}

/// Rays along axes, rays to vertices and edges, rays that hit nothing by definition, and rays of other lengths.
TEST_F(GpuTracerTest, SpecialRays) {
  const test::BakedScene baked(test::varied_scene());
  const GpuTracer tracer(baked.file, baked.source, config_);
  const PackedTracer& packed = tracer.packed();
  Bounds near;
  near.extend(DVec3(-8, -0.5, -8)), near.extend(DVec3(8, 5, 8));
  std::vector<Ray> rays = test::random_rays(kRays, near, tracer.space(), 5);
  const std::vector<RayHit> hits = test::closest(packed, rays);
  for (size_t i = 0; i < rays.size(); ++i) {
    Ray& ray = rays[i];
    switch (i % 8) {
    case 0:
      ray.direction = {0, ray.direction.y, 0};
      break;
    case 1:
      ray.direction = {ray.direction.x, 0, -0.0f};
      break;
    case 2:
      ray.tfar = hits[i].valid() ? hits[i].t : 1.0f;
      break; // tfar itself is excluded
    case 3:
      ray.tnear = hits[i].valid() ? hits[i].t : 0.0f;
      break;
    case 4:
      ray.direction *= 1e-20f;
      break;
    case 5:
      ray.direction *= 1e20f;
      break;
    case 6:
      ray.tfar = i % 16 == 6 ? -1.0f : 0.0f;
      break;
    default: // to a vertex
      if (hits[i].valid()) {
        const HitSurface surface = packed.resolve(hits[i]);
        const DVec3 vertex = transform_point(surface.placement->unit_from_surface, DVec3(surface.vertices[i % 3]));
        ray.direction = Vec3(vertex - DVec3(ray.origin));
      }
    }
  }
  rays.push_back({Vec3(0), 0.0f, Vec3(0), 1.0f});
  rays.push_back({Vec3(NAN), 0.0f, Vec3(0, 1, 0), 1.0f});
  expect_same(tracer, rays, 100);
}

TEST_F(GpuTracerTest, MovedInstances) {
  const test::BakedScene baked(test::thicket_scene());
  Movers movers;
  const uint32_t mover = static_cast<uint32_t>(baked.source.instances().size()) - 1;
  movers.instances = {mover};
  movers.world.extend(DVec3(-20)), movers.world.extend(DVec3(20));
  GpuTracer tracer(baked.file, baked.source, config_, movers);
  const Affine moved[] = {Affine(placed({0, 3, 0}, DVec3(4), 30))};
  const uint64_t all_bytes = tracer.scene().uploaded_bytes();
  tracer.place_instances(movers.instances, moved);
  EXPECT_GT(tracer.scene().uploaded_bytes(), 0u);
  EXPECT_LE(tracer.scene().uploaded_bytes(), all_bytes);
  tracer.place_instances(movers.instances, moved);
  EXPECT_EQ(tracer.scene().uploaded_bytes(), 0u) << "nothing changed";
  Bounds near;
  near.extend(DVec3(-8, -0.5, -8)), near.extend(DVec3(8, 8, 8));
  const std::vector<Ray> rays = test::random_rays(kRays, near, tracer.space(), 3);
  expect_same(tracer, rays, kRays / 4);
  size_t on_mover = 0;
  for (const RayHit& hit : test::closest(tracer, rays))
    on_mover += hit.valid() && tracer.resolve(hit).placement->instance == mover ? 1 : 0;
  EXPECT_GT(on_mover, 100u);
}

/// The last instances of a source as movers.
Movers last_instances(const SceneSource& source, uint32_t count) {
  Movers movers;
  const uint32_t all = static_cast<uint32_t>(source.instances().size());
  for (uint32_t i = all - count; i < all; ++i) movers.instances.push_back(i);
  movers.world.extend(DVec3(-8)), movers.world.extend(DVec3(8));
  return movers;
}

const Affine kFlat(placed({0, 0, 0}, DVec3(0)));

/// Placements change their numbers, and each keeps the masks of its own instance.
TEST_F(GpuTracerTest, MaskedInstancesThatBecomeFlatAndBack) {
  Scene scene;
  for (const float width : {6.0f, 6.5f})
    add_object(scene, test::quad({-3, -2, 0}, {width, 0, 0}, {0, 5, 0}), kAlphaMask);
  scene.masks.push_back({64, 1, WrapMode::kRepeat, Vec2(4, 1), Vec2(0), {0u, ~0u}});
  scene.masks.push_back({64, 1, WrapMode::kRepeat, Vec2(3, 1), Vec2(0), {~0u, 0u}});
  scene.materials[0].alpha_mask = 0, scene.materials[1].alpha_mask = 1;
  for (const uint32_t object : {0u, 0u, 1u, 1u}) {
    const double z = 2.0 * static_cast<double>(scene.instances.size()) - 3;
    scene.instances.push_back({object, Affine(placed({0.1 * z, 0, z}))});
  }
  const test::BakedScene baked(scene);
  const Movers movers = last_instances(baked.source, 4);
  GpuTracer tracer(baked.file, baked.source, config_, movers);
  const std::vector<Ray> rays = test::random_rays(kRays, baked.source.world_bounds(), tracer.space(), 3);
  const Affine before = baked.source.instances()[movers.instances[0]].world_from_object;
  for (const Affine& place : {kFlat, before}) {
    tracer.place_instances(std::span(movers.instances).first(1), {&place, 1});
    expect_same(tracer, rays, kRays / 10);
  }
  const std::vector<Affine> all_flat(4, kFlat);
  tracer.place_instances(movers.instances, all_flat);
  expect_same(tracer, rays, 0);
}

/// Whether there is a tree over placements changes with their number.
TEST_F(GpuTracerTest, InstancesThatLeaveASinglePlacement) {
  Scene scene = sphere_scene();
  add_object(scene, test::sphere({0, 0, 0}, 1, 16));
  for (const double x : {-2.5, 2.5}) scene.instances.push_back({0, Affine(placed({x, 0, 0}))});
  const test::BakedScene baked(scene);
  const Movers movers = last_instances(baked.source, 2);
  GpuTracer tracer(baked.file, baked.source, config_, movers);
  const std::vector<Ray> rays = test::random_rays(kRays, baked.source.world_bounds(), tracer.space(), 3);
  const std::vector<Affine> flat(2, kFlat);
  tracer.place_instances(movers.instances, flat);
  EXPECT_TRUE(tracer.packed().placed_trees().top_nodes().empty());
  expect_same(tracer, rays, kRays / 20);
  const Affine back[] = {Affine(placed({0, 2, 0})), Affine(placed({0, -2, 0}))};
  tracer.place_instances(movers.instances, back);
  EXPECT_FALSE(tracer.packed().placed_trees().top_nodes().empty());
  expect_same(tracer, rays, kRays / 10);
}

TEST_F(GpuTracerTest, LevelsOfDetail) {
  Scene scene = sphere_scene();
  add_object(scene, test::sphere({0, 0, 0}, 1, 40));
  for (const double z : {3.0, 60.0}) scene.instances.push_back({0, Affine(placed({2, 1, z}))});
  BakeConfig config;
  config.lod = LodUse::kAll;
  const test::BakedScene baked(scene, config);
  const PrimaryCamera camera(test::camera_at({1, 3, -10}, {0, 1, 0}), {96, 64});
  const std::vector<LodGeometry> geometries = lod_geometries(baked.file);
  const std::vector<LodInstance> instances = lod_instances(baked.source);
  LodSharing sharing(geometries, instances, {});
  const LodPlan plan = sharing.plan(detail_view(camera, baked.file.world_bounds(), 2.0));
  const LodSource source(baked.file, baked.source, sharing, plan);
  const GpuTracer tracer(baked.file, source, config_);
  expect_same(tracer, test::random_rays(kRays, baked.source.world_bounds(), tracer.space()), 20);
}

TEST_F(GpuTracerTest, NoRaysAndAnEmptyScene) {
  const test::BakedScene baked(sphere_scene());
  const GpuTracer tracer(baked.file, baked.source, config_);
  EXPECT_TRUE(test::closest(tracer, {}).empty());
  EXPECT_TRUE(test::any(tracer, {}).empty());
}

/// Work is split by time: 4,000 rays in dispatches of at most 64 give the same hits.
TEST_F(GpuTracerTest, ShortDispatches) {
  const test::BakedScene baked(sphere_scene());
  GpuConfig config = config_;
  config.dispatch_ms = 1e-6;
  const GpuTracer tracer(baked.file, baked.source, config);
  const std::vector<Ray> warm_up = test::random_rays(3 * 8192, baked.source.world_bounds(), tracer.space(), 2);
  test::any(tracer, warm_up);
  expect_same(tracer, test::random_rays(1000, baked.source.world_bounds(), tracer.space()), 100);
}

} // namespace
} // namespace packtrace
