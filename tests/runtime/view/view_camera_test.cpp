#include "runtime/view/view_camera.h"

#include <cmath>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/scene/camera_rays.h"
#include "tests/runtime/trace/test_scenes.h"

namespace packtrace {
namespace {

constexpr ImageSize kImage{100, 100};

Camera start() { return test::camera_at({0, 1, -5}, {0, 1, 0}, 50.0); }

/// Where the picture of the camera shows a point.
glm::dvec2 pixel_of(const Camera& camera, DVec3 point) {
  return PrimaryCamera(camera, kImage).project(point).value().pixel;
}

Camera mirrored(Camera camera) {
  camera.world_from_camera[0] = -camera.world_from_camera[0];
  return camera;
}

TEST(ViewCamera, StaysTheBaseUntilItMoves) {
  ViewCamera camera(start(), DVec3(0), {0, 1, 0}, 5.0);
  EXPECT_FALSE(camera.key());
  EXPECT_EQ(camera.camera().world_from_camera, start().world_from_camera);
  camera.move({0, 0, 1});
  EXPECT_TRUE(camera.key());
  camera.reset();
  EXPECT_FALSE(camera.key());
  EXPECT_EQ(camera.camera().world_from_camera, start().world_from_camera);
}

TEST(ViewCamera, StaysInPlaceWhenItsSceneIsReplaced) {
  ViewCamera camera(start(), DVec3(0), {0, 1, 0}, 5.0);
  const ViewCamera same(start(), DVec3(0), {0, 1, 0}, 5.0);
  camera.change_scene(same);
  EXPECT_FALSE(camera.key()) << "it is still the base";
  const CameraKey key = camera.current_key();
  const DVec3 far(1e6, -2e6, 3e6);
  const ViewCamera moved(test::camera_at({0, 2, -5}, {0, 1, 0}, 50.0), far, {0, 1, 0}, 5.0);
  camera.change_scene(moved);
  ASSERT_TRUE(camera.key());
  EXPECT_EQ(camera_key_text(*camera.key()), camera_key_text(key));
  const DVec3 position(camera.camera().world_from_camera[3]);
  EXPECT_LT(glm::length(position + far - key.position), 1e-9);
  EXPECT_LT(glm::length(camera.pivot() + far - DVec3(0, 1, 0)), 1e-9);
  const Camera elsewhere = camera.in_scene(DVec3(0), start());
  EXPECT_LT(glm::length(DVec3(elsewhere.world_from_camera[3]) - key.position), 1e-9);
}

TEST(ViewCamera, LookingRightMovesThePictureLeftAndLookingUpMovesItDown) {
  for (const Camera& base : {start(), mirrored(start())}) {
    const DVec3 target(0, 1, 0);
    ViewCamera camera(base, DVec3(0), {0, 1, 0}, 5.0);
    camera.look(10.0, 0.0);
    EXPECT_LT(pixel_of(camera.camera(), target).x, 40.0);
    EXPECT_NEAR(pixel_of(camera.camera(), target).y, 50.0, 0.01);
    camera.look(-10.0, 10.0);
    EXPECT_NEAR(pixel_of(camera.camera(), target).x, 50.0, 0.01);
    EXPECT_GT(pixel_of(camera.camera(), target).y, 60.0);
  }
}

TEST(ViewCamera, MovesAlongThePicturesAxes) {
  for (const Camera& base : {start(), mirrored(start())}) {
    const DVec3 target(0, 1, 0);
    ViewCamera camera(base, DVec3(0), {0, 1, 0}, 5.0);
    camera.move({1, 0, 0});
    EXPECT_LT(pixel_of(camera.camera(), target).x, 45.0) << "the camera went right";
    camera.move({-1, 1, 0});
    EXPECT_GT(pixel_of(camera.camera(), target).y, 55.0) << "the camera went up";
    camera.move({0, -1, 2});
    EXPECT_NEAR(PrimaryCamera(camera.camera(), kImage).view_z(target), 3.0, 1e-6);
  }
}

TEST(ViewCamera, TurnsAboutItsPivotAtAConstantDistance) {
  ViewCamera camera(start(), DVec3(0), {0, 1, 0}, 5.0);
  const DVec3 pivot(0, 1, 0);
  EXPECT_NEAR(glm::length(camera.pivot() - pivot), 0.0, 1e-12);
  for (int i = 0; i < 36; ++i) {
    camera.turn(10.0, i < 5 ? -7.0 : 0.0);
    EXPECT_NEAR(glm::length(DVec3(camera.camera().world_from_camera[3]) - pivot), 5.0, 1e-5);
    EXPECT_NEAR(pixel_of(camera.camera(), pivot).x, 50.0, 0.01);
  }
  EXPECT_NEAR(camera.current_key().up.y, std::cos(glm::radians(35.0)), 1e-6) << "no roll came in";
}

TEST(ViewCamera, NeverPassesTheVertical) {
  ViewCamera camera(start(), DVec3(0), {0, 1, 0}, 5.0);
  for (int i = 0; i < 10; ++i) camera.look(0.0, 60.0);
  const DVec3 forward = glm::normalize(DVec3(camera.camera().world_from_camera[2]));
  EXPECT_NEAR(glm::degrees(std::asin(forward.y)), 89.0, 1e-4);
  for (int i = 0; i < 10; ++i) camera.look(0.0, -60.0);
  EXPECT_NEAR(glm::degrees(std::asin(glm::normalize(DVec3(camera.camera().world_from_camera[2])).y)), -89.0, 1e-4);
}

TEST(ViewCamera, ItsTextIsTheCamera) {
  const DVec3 origin(1e6, -20, 3.25);
  ViewCamera camera(start(), origin, {0, 1, 0}, 5.0);
  camera.look(12.34567, -3.21);
  camera.move({0.123456789, 1.0 / 3.0, -2});
  CameraKey key = parse_camera_key(camera_key_text(*camera.key()), CameraKey());
  key.position -= origin, key.look -= origin;
  EXPECT_EQ(camera_of_key(key, start()).world_from_camera, camera.camera().world_from_camera);
}

TEST(ViewCamera, FramesTheWholeScene) {
  Bounds bounds;
  bounds.extend(DVec3(-3, 0, -3)), bounds.extend(DVec3(3, 2, 4));
  ViewCamera camera(start(), DVec3(0), {0, 1, 0}, 5.0);
  camera.look(70.0, -20.0);
  camera.frame(bounds);
  for (int corner = 0; corner < 8; ++corner) {
    const DVec3 point((corner & 1) != 0 ? 3 : -3, (corner & 2) != 0 ? 2 : 0, (corner & 4) != 0 ? 4 : -3);
    const glm::dvec2 pixel = pixel_of(camera.camera(), point);
    EXPECT_TRUE(pixel.x > 0 && pixel.x < 100 && pixel.y > 0 && pixel.y < 100) << pixel.x << " " << pixel.y;
  }
}

TEST(ViewCamera, WrongTextsAreRefused) {
  for (const char* text : {"", "1,2,3", "1,2,3,4,5,6,7", "1,2,3,1,2,3", "1,2,3,4,5,x", "1,2,3,4,5,6,0,0,0",
                           "1,2,3,4,5,6,0,1,0,180", "1,2,3,4,5,6,", "nan,2,3,4,5,6"})
    EXPECT_THROW(parse_camera_key(text, CameraKey()), Error) << text;
  EXPECT_EQ(parse_camera_key("1,2,3,4,5,6", CameraKey()).look, DVec3(4, 5, 6));
}

} // namespace
} // namespace packtrace
