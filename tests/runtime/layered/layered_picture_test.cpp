// Conventions of renderers: depths, normals, motion, occlusion, background, and values that are no numbers.

#include "runtime/layered/layered_picture.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "pbrt_import/base/file_bytes.h"
#include "runtime/layered/picture_overlap.h"
#include "tests/runtime/image/image_test_support.h"
#include "tests/runtime/layered/foreign_pictures.h"
#include "tests/temporary_folder.h"

namespace packtrace {
namespace {

constexpr ImageSize kPictureSize{16, 8};
constexpr float kInf = std::numeric_limits<float>::infinity(), kNaN = std::numeric_limits<float>::quiet_NaN();

LayeredPicture read_back(const foreign::Channels& channels, const LayerConventions& conventions = {}) {
  const TemporaryFolder folder;
  foreign::write(folder / "a.exr", kPictureSize, channels);
  LayeredReading reading;
  reading.conventions = conventions;
  return read_layered_picture(folder / "a.exr", reading, MemoryBudget());
}

TEST(LayeredPicture, BackgroundIsZeroHugeInfiniteAndNoNumber) {
  foreign::Channels wall = foreign::wall(kPictureSize, 0);
  std::vector<float>& depth = wall["depth"];
  depth[0] = 0.0f, depth[1] = 1e10f, depth[2] = kInf, depth[3] = kNaN, depth[4] = -1.0f;
  const LayeredPicture picture = read_back(wall);
  for (size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(picture.gbuffer.view_z[i], 0.0f) << i;
    EXPECT_EQ(picture.gbuffer.instance[i], kNoInstance) << i;
    EXPECT_EQ(picture.ao.ao[i], kInvalidAo) << i;
  }
  EXPECT_EQ(picture.gbuffer.view_z[5], 10.0f);
  EXPECT_EQ(picture.counts.surfaces, kPictureSize.pixels() - 5);
  EXPECT_EQ(picture.counts.not_finite_depth, 2u);
  LayerConventions near;
  near.far_depth = 10.0f;
  EXPECT_EQ(read_back(wall, near).counts.surfaces, 0u);
}

TEST(LayeredPicture, SamplesThatAreNoNumbersOrNegativeAreMissing) {
  foreign::Channels wall = foreign::wall(kPictureSize, 0);
  std::vector<float>& ao = wall["ao"];
  ao[0] = kNaN, ao[1] = -kInf, ao[2] = -1.0f, ao[3] = -0.01f, ao[4] = 1.5f, ao[5] = 0.25f, ao[6] = kInf;
  const LayeredPicture picture = read_back(wall);
  for (const size_t i : {0u, 1u, 2u, 6u}) EXPECT_EQ(picture.ao.ao[i], kInvalidAo) << i;
  EXPECT_EQ(picture.ao.ao[3], 0.0f) << "a filter's negative lobe";
  EXPECT_EQ(picture.ao.ao[4], 1.0f);
  EXPECT_EQ(picture.ao.ao[5], 0.25f);
  EXPECT_EQ(picture.counts.without_sample, 4u);
  EXPECT_EQ(picture.counts.not_finite_ao, 3u);
  EXPECT_EQ(picture.counts.clamped_ao, 1u);
  LayerConventions inverted;
  inverted.inverted_ao = true;
  EXPECT_EQ(read_back(wall, inverted).ao.ao[5], 0.75f);
  EXPECT_EQ(read_back(wall, inverted).ao.ao[2], kInvalidAo);
}

/// A wall across the view at depth 10, by its distance from the camera.
TEST(LayeredPicture, RayDistancesBecomeDepths) {
  foreign::Channels wall = foreign::wall(kPictureSize, 0);
  LayerConventions conventions;
  conventions.ray_distance = true;
  conventions.fov_degrees = 60.0;
  const double pixel = std::tan(30.0 * std::numbers::pi / 180.0) / (kPictureSize.height / 2.0);
  for (uint32_t y = 0; y < kPictureSize.height; ++y)
    for (uint32_t x = 0; x < kPictureSize.width; ++x)
      wall["depth"][y * kPictureSize.width + x] =
          static_cast<float>(10.0 * std::hypot(1.0, (x + 0.5 - 8.0) * pixel, (y + 0.5 - 4.0) * pixel));
  for (const float z : read_back(wall, conventions).gbuffer.view_z) EXPECT_NEAR(z, 10.0f, 1e-5f);
}

TEST(LayeredPicture, NegativeDepthsOfACameraThatLooksBackwardsAreNegated) {
  foreign::Channels wall = foreign::wall(kPictureSize, 0);
  for (float& z : wall["depth"]) z = -z;
  const LayeredPicture picture = read_back(wall);
  EXPECT_TRUE(picture.counts.negative_depth);
  EXPECT_EQ(picture.gbuffer.view_z[0], 10.0f);
}

TEST(LayeredPicture, NormalsHaveUnitLengthAndMayBeUnsigned) {
  foreign::Channels wall = foreign::wall(kPictureSize, 0);
  wall["normal.Z"][0] = -3.0f, wall["normal.Z"][1] = 0.0f, wall["normal.Z"][2] = kNaN;
  const LayeredPicture picture = read_back(wall);
  EXPECT_EQ(picture.gbuffer.normal[0], Vec3(0, 0, -1));
  EXPECT_EQ(picture.gbuffer.normal[1], Vec3(0));
  EXPECT_EQ(picture.gbuffer.normal[2], Vec3(0));
  EXPECT_EQ(picture.counts.without_normal, 2u);
  for (const char* const axis : {"normal.X", "normal.Y", "normal.Z"})
    for (float& n : wall[axis]) n = 0.5f + 0.5f * n;
  LayerConventions conventions;
  conventions.unsigned_normals = true;
  EXPECT_EQ(read_back(wall, conventions).gbuffer.normal[5], Vec3(0, 0, -1));
}

TEST(LayeredPicture, MotionIsScaledToPixelsFromThePreviousPicture) {
  foreign::Channels wall = foreign::wall(kPictureSize, 0);
  wall["Vector.X"] = wall["Vector.Y"] = std::vector<float>(kPictureSize.pixels(), 2.0f);
  EXPECT_EQ(read_back(wall).gbuffer.motion_px[0], Vec2(2, 2));
  wall["Vector.Z"] = wall["Vector.W"] = std::vector<float>(kPictureSize.pixels(), 0.0f);
  EXPECT_EQ(read_back(wall).gbuffer.motion_px[0], Vec2(-2, 2)) << "Blender's";
  LayerConventions conventions;
  conventions.motion_scale = Vec2(-16, -8);
  EXPECT_EQ(read_back(wall, conventions).gbuffer.motion_px[0], Vec2(-32, -16));
  wall["Vector.X"][0] = kNaN;
  EXPECT_EQ(read_back(wall).counts.not_finite_motion, 1u);
}

TEST(LayeredPicture, ConventionsOutOfRangeAreRefused) {
  LayerConventions conventions;
  conventions.ray_distance = true;
  EXPECT_EQ(error_kind_of([&] { conventions.validate(); }), ErrorKind::kUsage) << "no field of view";
  for (const double fov : {0.0, 180.0, -1.0, std::nan("")}) {
    conventions.fov_degrees = fov;
    EXPECT_EQ(error_kind_of([&] { conventions.validate(); }), ErrorKind::kUsage) << fov;
  }
  conventions = {};
  conventions.far_depth = 0.0f;
  EXPECT_EQ(error_kind_of([&] { conventions.validate(); }), ErrorKind::kUsage);
}

TEST(LayeredPicture, MemoryIsReservedBeforeItIsUsed) {
  const TemporaryFolder folder;
  foreign::write(folder / "a.exr", kPictureSize, foreign::wall(kPictureSize, 0));
  const MemoryBudget budget(30'000);
  try {
    read_layered_picture(folder / "a.exr", {}, budget);
    FAIL() << "the budget was exceeded";
  } catch (const MemoryError& error) {
    EXPECT_NE(std::string(error.what()).find("a.exr"), std::string::npos) << error.what();
  }
  EXPECT_EQ(budget.used(), 0u);
}

TEST(PictureOverlap, CountsSurfacesThatWereSeenWhereTheMotionSays) {
  GBuffer now = synthetic::wall({8, 4});
  const PictureSurfaces before{now.size, now.view_z, now.normal};
  EXPECT_EQ(shared_surfaces(before, now), 1.0);
  for (Vec2& motion : now.motion_px) motion = Vec2(2, 0);
  EXPECT_EQ(shared_surfaces(before, now), 0.75) << "two columns come from outside";
  for (float& z : now.view_z) z = 12.0f;
  EXPECT_EQ(shared_surfaces(before, now), 0.0) << "other depths";
  now.previous_z.assign(now.size.pixels(), 10.0f);
  EXPECT_EQ(shared_surfaces(before, now), 0.75) << "they come nearer";
  for (Vec3& normal : now.normal) normal = Vec3(0, 1, 0);
  EXPECT_EQ(shared_surfaces(before, now), 0.0);
  for (Vec2& motion : now.motion_px) motion = Vec2(kNaN, kInf);
  EXPECT_EQ(shared_surfaces(before, now), 0.0);
}

} // namespace
} // namespace packtrace
