#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "compress/format/file/baked_file.h"
#include "runtime/voxels/voxel_picture.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();

/// Balls of radius 1 around (4 i, 0, 0), some mirrored or stretched, and a flattened one.
Scene balls(uint32_t count) {
  Scene scene;
  scene.materials.emplace_back();
  scene.materials[0].albedo = Vec3(0.25f, 0.5f, 0.75f);
  scene.meshes.push_back(test::sphere_mesh(40));
  scene.objects.push_back({"ball", {Shape{0, 0, false, DAffine(1.0)}}});
  for (uint32_t i = 0; i < count; ++i)
    scene.instances.push_back({0, Affine(compose(test::translation(DVec3(4.0 * i, 0, 0)),
                                                 test::scaling(i % 2 == 0 ? DVec3(1.0) : DVec3(-1.0, 1.0, 1.5))))});
  scene.instances.push_back({0, Affine(test::scaling(DVec3(1.0, 1.0, 0.0)))});
  return scene;
}

BakedFile baked_balls(uint32_t count, bool materials = false) {
  BakeConfig config;
  config.proxy.use = ProxyUse::kVoxels;
  config.proxy.voxels = 60;
  config.proxy.materials = materials;
  return BakedFile::from_bytes(test::bake(balls(count), config).bytes);
}

TEST(VoxelScene, RaysMeetTheInstancesWhereTheirSurfacesAre) {
  const BakedFile file = baked_balls(5, true);
  const VoxelScene scene(file);
  EXPECT_EQ(scene.instance_count(), 5u);
  EXPECT_EQ(scene.flat_instances(), 1u);
  EXPECT_EQ(scene.instances_without_proxy(), 0u);
  const double voxel = 2.0 / 60.0;
  for (uint32_t i = 0; i < 5; ++i) {
    const double depth = i % 2 == 0 ? 1.0 : 1.5;
    const auto hit = scene.first_hit(DVec3(4.0 * i + 0.01, 0.02, -9.0) - file.origin(), DVec3(0, 0, 2), 0.0, kFar);
    ASSERT_TRUE(hit.has_value());
    EXPECT_EQ(hit->instance, i);
    EXPECT_NEAR(-9.0 + 2.0 * hit->t, -depth, 1.5 * voxel * depth);
    EXPECT_NEAR(hit->normal.z, -1.0, 1e-9);
    EXPECT_NEAR(hit->edge, voxel * depth, 1e-3);
    EXPECT_NEAR(hit->albedo.y, 0.5f, 0.005f);
  }
  EXPECT_FALSE(scene.first_hit(DVec3(2.0, 0, -9.0) - file.origin(), DVec3(0, 0, 1), 0.0, kFar).has_value());
  EXPECT_TRUE(scene.occluded(DVec3(-9, 0, 0) - file.origin(), DVec3(1, 0, 0), 0.0, kFar));
  EXPECT_FALSE(scene.occluded(DVec3(-9, 0, 0) - file.origin(), DVec3(1, 0, 0), 0.0, 7.9));
}

TEST(VoxelScene, TheFirstHitOfManyIsTheNearest) {
  const BakedFile file = baked_balls(40);
  const VoxelScene all(file);
  std::vector<std::unique_ptr<VoxelScene>> single;
  for (uint32_t i = 0; i < 40; ++i)
    single.push_back(std::make_unique<VoxelScene>(file, [&](uint32_t instance) { return instance == i; }));
  test::Random random(3);
  uint64_t hits = 0;
  for (int r = 0; r < 400; ++r) {
    const DVec3 origin(random.uniform(-10, 170), random.uniform(-2, 2), random.uniform(-2, 2));
    const DVec3 direction(random.uniform(-1, 1), random.uniform(-0.2f, 0.2f), random.uniform(-0.2f, 0.2f));
    double nearest = kFar;
    for (const auto& one : single)
      if (const auto hit = one->first_hit(origin, direction, 0.0, kFar)) nearest = std::min(nearest, hit->t);
    const auto hit = all.first_hit(origin, direction, 0.0, kFar);
    ASSERT_EQ(hit.has_value(), std::isfinite(nearest));
    ASSERT_EQ(all.occluded(origin, direction, 0.0, kFar), hit.has_value());
    hits += hit.has_value();
    if (hit.has_value()) {
      ASSERT_EQ(hit->t, nearest);
    }
  }
  EXPECT_GT(hits, 100u);
}

/// The tree's boxes of turned instances are tighter than their grids: no ray may lose a voxel for that.
TEST(VoxelScene, TurnedInstancesHaveAllTheirVoxels) {
  Scene scene = balls(0);
  scene.instances.clear();
  DAffine turned(1.0);
  turned[0] = DVec3(0.8, 0.36, -0.48), turned[1] = DVec3(-0.6, 0.48, -0.64), turned[2] = DVec3(0.0, 0.8, 0.6);
  for (uint32_t i = 0; i < 8; ++i)
    scene.instances.push_back({0, Affine(compose(test::translation(DVec3(4.0 * i, 0, 0)), turned))});
  BakeConfig config;
  config.proxy.use = ProxyUse::kVoxels, config.proxy.voxels = 9;
  const BakedFile file = BakedFile::from_bytes(test::bake(scene, config).bytes);
  const VoxelScene voxels(file);
  const Proxy& proxy = voxels.proxies().at(0);
  decode_occupancy(proxy.voxels).for_each([&](VoxelIndex v) {
    for (uint32_t i = 0; i < 8; ++i)
      for (int corner = 0; corner < 8; ++corner) {
        const DVec3 to(corner & 1, corner >> 1 & 1, corner >> 2);
        const DVec3 p = proxy.frame().center(v) + 0.999 * proxy.record.edge * (to - 0.5);
        const DAffine place(file.world_from_object(i));
        EXPECT_TRUE(voxels.occluded(transform_point(place, p), DVec3(0, 0, 1e-9), 0.0, 1.0));
      }
  });
}

TEST(VoxelScene, InstancesThatScalesNearZeroFlattenAreNotTraced) {
  Scene scene = balls(1); // with one of scale 0
  for (const DVec3 scale : {DVec3(1, 1, 1e-30), DVec3(1e-8, 1, 1), DVec3(1e-30), DVec3(1e-5, 1, 1), DVec3(1e-3)})
    scene.instances.push_back({0, Affine(test::scaling(scale))});
  BakeConfig config;
  config.proxy.use = ProxyUse::kVoxels;
  config.proxy.voxels = 8;
  const VoxelScene voxels(BakedFile::from_bytes(test::bake(scene, config).bytes));
  EXPECT_EQ(voxels.flat_instances(), 4u);
  EXPECT_EQ(voxels.instance_count(), 3u);
}

TEST(VoxelPicture, IsTheMeanOfItsViewsForAnyNumberOfThreads) {
  const BakedFile file = baked_balls(1);
  const VoxelScene scene(file);
  const Camera camera = framing_camera(file.world_bounds(), {24, 18}, {});
  const auto view = [&](uint32_t v) {
    return PrimaryCamera(camera, {24, 18}, glm::dvec2(v % 2, v / 2) * 0.5 - 0.25); // NOLINT(bugprone-integer-division)
  };
  VoxelPictureConfig config;
  config.views = 4, config.samples = 2;
  Progress progress;
  const VoxelPicture picture = trace_voxel_picture(scene, view, config, progress);
  double hits = 0.0;
  uint32_t edges = 0;
  for (const float share : picture.coverage) {
    EXPECT_EQ(4.0f * share, std::round(4.0f * share));
    hits += 4.0 * static_cast<double>(share), edges += share > 0.0f && share < 1.0f;
  }
  EXPECT_GT(edges, 10u);
  EXPECT_EQ(picture.rays, 24 * 18 * 4 + 2 * static_cast<uint64_t>(hits));
  EXPECT_EQ(picture.field_pixels, 0u);
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(trace_voxel_picture(scene, view, config, progress).color, picture.color);
}

} // namespace
} // namespace packtrace
