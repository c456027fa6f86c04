#include "compress/bake/grid/seam_gaps.h"

#include <algorithm>
#include <limits>

#include <gtest/gtest.h>

#include "tests/compress/test_scenes.h"

namespace packtrace::test {
namespace {

/// A sheet in world space, and an object of many small triangles whose first instance continues the sheet.
Scene sheet_and_instances(const DAffine& world_from_object) {
  Scene scene = scene_of(grid_mesh(10));
  Mesh beside = grid_mesh(10);
  const DAffine object_from_world = glm::inverse(glm::dmat4(world_from_object));
  for (Vec3& p : beside.positions) p = Vec3(transform_point(object_from_world, DVec3(p) + DVec3(1, 0, 0)));
  scene.meshes.push_back(std::move(beside));
  scene.objects.push_back({"beside", {Shape{1, 0, false, DAffine(1.0)}}});
  scene.instances.push_back({0, Affine(world_from_object)});
  DAffine away = world_from_object;
  away[3] += DVec3(0, 0, 50);
  scene.instances.push_back({0, Affine(away)});
  return scene;
}

std::vector<DVec3> placed_positions(const BakedFile& file, uint32_t instance) {
  const DAffine world_from_object(file.world_from_object(instance));
  std::vector<DVec3> points;
  for (const Vec3 p : decode(file, file.instances()[instance].geometry).positions)
    points.push_back(transform_point(world_from_object, DVec3(p)));
  return points;
}

TEST(SeamGaps, HoldForWhatTouches) {
  const DAffine turned(DVec3(3.6, 4.8, -8), DVec3(-8, 6, 0), DVec3(4.8, 6.4, 6), DVec3(0.3, -0.2, 0.1));
  const DAffine flattened(DVec3(0.01, 0, 0), DVec3(0, 100, 0), DVec3(0, 0, 1), DVec3(0));
  for (const DAffine& world_from_object : {DAffine(1.0), turned, flattened})
    for (const double precision : {1.0 / 128, 1.0 / 4}) {
      BakeConfig config;
      config.precision = precision;
      const BakedFile file = BakedFile::from_bytes(bake(sheet_and_instances(world_from_object), config).bytes);
      const InstanceSeams seams(file);
      EXPECT_EQ(seams.summary().instances, 2u);
      ASSERT_EQ(seams.touching().size(), 1u);
      ASSERT_EQ(seams.touching()[0], 1u);
      double widest = 0.0;
      uint32_t compared = 0;
      const std::vector<DVec3> sheet = placed_positions(file, 0);
      for (const DVec3 p : placed_positions(file, 1)) {
        if (p.x > 1.05) continue; // not at the seam
        double nearest = std::numeric_limits<double>::infinity();
        for (const DVec3 q : sheet) nearest = std::min(nearest, glm::length(p - q));
        widest = std::max(widest, nearest);
        ++compared;
      }
      constexpr double kInstanceRounding = 1e-6; // of the transform's floats
      EXPECT_GT(compared, 5u);
      EXPECT_LE(widest, seams.gaps()[0] + kInstanceRounding) << precision;
      EXPECT_EQ(seams.summary().largest_gap, seams.gaps()[0]);
      if (world_from_object != flattened) { // edges are 0.1 long, diagonals 0.14
        EXPECT_LT(seams.gaps()[0], 0.5 * precision);
      }
      EXPECT_EQ(seams.largest_touching(std::vector<double>{7, 1, 9}), std::vector<double>{7});
    }
}

TEST(SeamGaps, GeometryInWorldSpaceHasNone) {
  Scene scene = scene_of(grid_mesh(10));
  add_shape(scene, grid_mesh(8), translation({1, 0, 0}));
  const BakedFile file = BakedFile::from_bytes(bake(scene).bytes);
  const InstanceSeams seams(file);
  EXPECT_EQ(seams.summary().instances, 0u);
  EXPECT_TRUE(seams.touching().empty());
  EXPECT_EQ(seams.summary().largest_gap, 0.0);
}

} // namespace
} // namespace packtrace::test
