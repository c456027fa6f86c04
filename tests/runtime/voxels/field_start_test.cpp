#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "compress/format/file/baked_file.h"
#include "runtime/voxels/voxel_scene.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

constexpr double kNoLimit = std::numeric_limits<double>::infinity();

/// One grid over [0, 1]^2 per shape, as an object of its own with the given instances, as fields without signs.
struct Grid {
  DAffine shape;
  std::vector<DVec3> instances;
};

BakedFile fields_of(const std::vector<Grid>& grids) {
  Scene scene;
  scene.materials.emplace_back();
  scene.meshes.push_back(test::grid_mesh(4));
  for (const Grid& grid : grids) {
    for (const DVec3 by : grid.instances)
      scene.instances.push_back({static_cast<uint32_t>(scene.objects.size()), Affine(test::translation(by))});
    scene.objects.push_back({"grid", {Shape{0, 0, false, grid.shape}}});
  }
  BakeConfig config;
  config.proxy.use = ProxyUse::kField, config.proxy.voxels = 16;
  return BakedFile::from_bytes(test::bake(scene, config).bytes);
}

DAffine moved(double scale, DVec3 by) { return compose(test::translation(by), test::scaling(DVec3(scale))); }

TEST(FieldStart, RaysOfCoarseVoxelsDoNotStartBeyondFinerInstances) {
  // The ground of 8 x 8 has voxels of 0.5, so its field is hit 0.3 above it, and its clearance is 0.45. With this
  // clearance, rays would start above the roof of 1 x 1 at height 0.45 and miss it.
  const BakedFile file =
      fields_of({{moved(8.0, {-4, -4, 0}), {DVec3(0.0)}}, {moved(1.0, {-0.5, -0.5, 0.45}), {DVec3(0.0)}}});
  const VoxelScene scene(file);
  ASSERT_EQ(scene.proxies().size(), 2u);
  ASSERT_EQ(scene.proxies()[0].record.flags & voxels::kSigned, 0u);
  for (double x = -0.4; x < 0.45; x += 0.1) {
    const DVec3 eye = DVec3(x, -3.0, 0.36) - file.origin(), aim = glm::normalize(DVec3(0.0, 3.0, -0.06));
    const auto hit = scene.first_hit(eye, aim, 0.0, kNoLimit);
    ASSERT_TRUE(hit);
    const DVec3 point = eye + hit->t * aim;
    ASSERT_EQ(hit->instance, 0u);
    ASSERT_LT(std::abs((point + file.origin()).y), 0.45);
    EXPECT_TRUE(scene.occluded_from(*hit, point, DVec3(0, 0, 1), 4.0)) << x;
    EXPECT_FALSE(scene.occluded_from(*hit, point, glm::normalize(DVec3(0, -1, 0.02)), 2.0)) << x;
  }
}

TEST(FieldStart, SurfacesThatContinueEachOtherDoNotOccludeEachOther) {
  // Equal planes, slanted to the samples, and moved along themselves by less than a voxel.
  DAffine slanted = test::translation(DVec3(0.0));
  slanted[0] = DVec3(1.0, 0.0, 0.31), slanted[1] = DVec3(0.0, 1.0, 0.47);
  const BakedFile file = fields_of({{slanted, {DVec3(0.0), DVec3(0.013, 0.027, 0.31 * 0.013 + 0.47 * 0.027)}}});
  const VoxelScene scene(file);
  ASSERT_EQ(scene.instance_count(), 2u);
  const DVec3 normal = glm::normalize(DVec3(-0.31, -0.47, 1.0)), along = glm::normalize(DVec3(1.0, 0.0, 0.31));
  std::array<uint32_t, 2> of{};
  for (double x = 0.2; x < 0.7; x += 0.0171)
    for (double y = 0.2; y < 0.8; y += 0.0137) {
      const DVec3 eye = DVec3(x, y, 5.0) - file.origin(), down(0.0, 0.0, -1.0);
      const auto hit = scene.first_hit(eye, down, 0.0, kNoLimit);
      ASSERT_TRUE(hit);
      ++of[hit->instance];
      EXPECT_FALSE(scene.occluded_from(*hit, eye + hit->t * down, glm::normalize(along + 0.2 * normal), 0.3));
    }
  EXPECT_GT(of[0], 100u);
  EXPECT_GT(of[1], 100u);
}

} // namespace
} // namespace packtrace
