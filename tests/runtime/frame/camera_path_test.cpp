#include "runtime/frame/camera_path.h"

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/scene/camera_rays.h"

namespace packtrace {
namespace {

CameraKey key_at(double time_s, DVec3 position, double fov = 60.0) {
  CameraKey key;
  key.time_s = time_s, key.position = position, key.look = DVec3(0.0), key.fov_degrees = fov;
  return key;
}

std::vector<CameraKey> some_keys() {
  return {key_at(0.0, DVec3(0, 1, -5)), key_at(1.0, DVec3(3, 2, -4), 50.0), key_at(1.5, DVec3(5, 1, 0), 40.0),
          key_at(4.0, DVec3(0, 3, 6), 70.0)};
}

DVec3 eye_of(const Camera& camera) { return DVec3(camera.world_from_camera[3]); }

double difference(const DAffine& a, const DAffine& b) {
  double largest = 0.0;
  for (int column = 0; column < 4; ++column)
    for (int axis = 0; axis < 3; ++axis) largest = std::max(largest, std::abs(a[column][axis] - b[column][axis]));
  return largest;
}

TEST(CameraPath, PassesItsKeys) {
  const std::vector<CameraKey> keys = some_keys();
  const CameraPath path(keys, Camera());
  for (const CameraKey& key : keys) {
    const Camera camera = path.at(key.time_s);
    EXPECT_LT(glm::distance(eye_of(camera), key.position), 1e-12);
    EXPECT_NEAR(camera.fov_degrees, key.fov_degrees, 1e-12);
    const PrimaryCamera view(camera, {64, 48});
    const std::optional<ProjectedPoint> looked_at = view.project(key.look);
    ASSERT_TRUE(looked_at);
    EXPECT_LT(glm::distance(looked_at->pixel, glm::dvec2(32, 24)), 1e-9); // in the middle of the image
    EXPECT_LT(view.project(key.look + DVec3(0, 0.1, 0))->pixel.y, 24.0);  // up is up
  }
}

TEST(CameraPath, StandsStillOutsideItsKeys) {
  const CameraPath path(some_keys(), Camera());
  EXPECT_EQ(path.at(-1.0).world_from_camera, path.at(0.0).world_from_camera);
  EXPECT_EQ(path.at(99.0).world_from_camera, path.at(4.0).world_from_camera);
}

TEST(CameraPath, VelocityIsContinuousAtKeys) {
  const CameraPath path(some_keys(), Camera());
  constexpr double kStep = 1e-5;
  for (const double t : {1.0, 1.5}) {
    const DVec3 before = (eye_of(path.at(t)) - eye_of(path.at(t - kStep))) / kStep;
    const DVec3 after = (eye_of(path.at(t + kStep)) - eye_of(path.at(t))) / kStep;
    EXPECT_LT(glm::distance(before, after), 1e-3) << t;
    EXPECT_GT(glm::length(before), 0.5);
  }
}

TEST(CameraPath, EqualStepsOnALineMoveEvenly) {
  const CameraPath path(
      {key_at(0, DVec3(0, 1, -5)), key_at(1, DVec3(1, 1, -5)), key_at(3, DVec3(3, 1, -5)), key_at(4, DVec3(4, 1, -5))},
      Camera());
  for (double t = 0.0; t <= 4.0; t += 0.25) EXPECT_NEAR(eye_of(path.at(t)).x, t, 1e-12) << t;
}

TEST(CameraPath, HandednessOfTheSceneIsKept) {
  Camera mirrored;
  mirrored.world_from_camera[0] = DVec3(-1, 0, 0);
  EXPECT_GT(glm::determinant(glm::dmat3(CameraPath(some_keys(), Camera()).at(0.7).world_from_camera)), 0.99);
  EXPECT_LT(glm::determinant(glm::dmat3(CameraPath(some_keys(), mirrored).at(0.7).world_from_camera)), -0.99);
}

TEST(CameraPath, AViewWithoutDirectionIsAvoided) {
  // Half way, the camera is where it looks.
  std::vector<CameraKey> keys{key_at(0, DVec3(0, 0, -1)), key_at(1, DVec3(0, 0, 1))};
  const Camera camera = CameraPath(keys, Camera()).at(0.5);
  EXPECT_NO_THROW(PrimaryCamera(camera, {8, 8}));
}

/// @return the message of the error that the keys cause; empty if there is none
std::string problem_with(std::vector<CameraKey> keys) {
  try {
    CameraPath(std::move(keys), Camera());
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kUsage);
    return error.what();
  }
  return {};
}

TEST(CameraPath, BadKeysAreNamed) {
  EXPECT_EQ(problem_with(some_keys()), "");
  EXPECT_NE(problem_with({some_keys()[0]}).find("two keys"), std::string::npos);
  EXPECT_NE(problem_with({}).find("two keys"), std::string::npos);
  const auto changed = [](const std::function<void(std::vector<CameraKey>&)>& change) {
    std::vector<CameraKey> keys = some_keys();
    change(keys);
    return problem_with(keys);
  };
  EXPECT_NE(changed([](auto& k) { k[2].time_s = 1.0; }).find("key 2: its time"), std::string::npos);
  EXPECT_NE(changed([](auto& k) { k[1].position.y = NAN; }).find("key 1: all numbers"), std::string::npos);
  EXPECT_NE(changed([](auto& k) { k[3].time_s = INFINITY; }).find("key 3: all numbers"), std::string::npos);
  EXPECT_NE(changed([](auto& k) { k[1].fov_degrees = 180.0; }).find("key 1: fov"), std::string::npos);
  EXPECT_NE(changed([](auto& k) { k[0].look = k[0].position; }).find("key 0: it looks at"), std::string::npos);
  EXPECT_NE(changed([](auto& k) { k[0].up = k[0].look - k[0].position; }).find("key 0: up"), std::string::npos);
}

TEST(Orbit, KeepsDistanceAndHeightAndReturns) {
  Camera camera;
  camera.world_from_camera[3] = DVec3(2, 3, -7);
  const DVec3 pivot(1, 0, 4), up(0, 1, 0);
  for (const double degrees : {30.0, 90.0, -200.0}) {
    const Camera turned = orbited(camera, pivot, up, degrees);
    EXPECT_NEAR(eye_of(turned).y, 3.0, 1e-12);
    EXPECT_NEAR(glm::distance(eye_of(turned), pivot), glm::distance(eye_of(camera), pivot), 1e-12);
    EXPECT_GT(glm::distance(eye_of(turned), eye_of(camera)), 1.0);
  }
  EXPECT_LT(difference(orbited(camera, pivot, up, 360.0).world_from_camera, camera.world_from_camera), 1e-12);
  // A camera in front of the pivot that looks along +z moves to its right, +x.
  camera.world_from_camera[3] = DVec3(0, 0, -5);
  EXPECT_GT(eye_of(orbited(camera, DVec3(0.0), up, 10.0)).x, 0.5);
}

TEST(Orbit, MirroredCamerasMoveToTheirRight) {
  Camera camera;
  camera.world_from_camera = DAffine(DVec3(-1, 0, 0), DVec3(0, 1, 0), DVec3(0, 0, 1), DVec3(0, 0, -5));
  EXPECT_LT(eye_of(orbited(camera, DVec3(0.0), DVec3(0, 1, 0), 10.0)).x, -0.5);
}

} // namespace
} // namespace packtrace
