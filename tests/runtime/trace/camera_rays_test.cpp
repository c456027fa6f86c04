#include "pbrt_import/scene/camera_rays.h"

#include <array>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/scene/world_view.h"

namespace packtrace {
namespace {

constexpr double kPi = std::numbers::pi;

void expect_near(DVec3 a, DVec3 b, double tolerance) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}

Camera perspective(double fov) {
  Camera camera;
  camera.fov_degrees = fov;
  return camera;
}

void expect_projects_back(const Camera& camera, ImageSize size, double distance) {
  const PrimaryCamera primary(camera, size, {0.25, -0.125});
  for (const auto& [x, y] : {std::pair{0u, 0u}, {size.width - 1, 0u}, {size.width / 3, size.height - 1}}) {
    const CameraRay ray = primary.ray(x, y);
    EXPECT_NEAR(glm::length(ray.direction), 1.0, 1e-12);
    const auto point = primary.project(ray.origin + ray.direction * distance);
    ASSERT_TRUE(point.has_value());
    EXPECT_NEAR(point->pixel.x, x + 0.5, 1e-6);
    EXPECT_NEAR(point->pixel.y, y + 0.5, 1e-6);
    if (camera.projection == Projection::kEnvironment) continue;
    const DVec3 homogeneous = primary.homogeneous_pixel(ray.origin + ray.direction * distance);
    EXPECT_GT(homogeneous.z, 0.0);
    EXPECT_NEAR(homogeneous.x / homogeneous.z, point->pixel.x, 1e-6);
    EXPECT_NEAR(homogeneous.y / homogeneous.z, point->pixel.y, 1e-6);
  }
}

TEST(PrimaryCamera, LooksAlongPositiveZWithYUpAndRasterYDown) {
  const PrimaryCamera camera(perspective(90), {4, 4});
  const DVec3 top_left = camera.ray(0, 0).direction;
  EXPECT_LT(top_left.x, 0.0);
  EXPECT_GT(top_left.y, 0.0);
  expect_near(top_left, glm::normalize(DVec3(-0.75, 0.75, 1.0)), 1e-12);
}

TEST(PrimaryCamera, FieldOfViewSpansTheShorterAxis) {
  const PrimaryCamera wide(perspective(90), {200, 100}), tall(perspective(90), {100, 200});
  const DVec3 w = wide.ray(199, 99).direction, t = tall.ray(99, 199).direction;
  EXPECT_NEAR(-w.y / w.z, 0.99, 1e-12); // tan 45 degrees, half a pixel inside the border
  EXPECT_NEAR(w.x / w.z, 1.99, 1e-12);
  EXPECT_NEAR(t.x / t.z, 0.99, 1e-12);
  EXPECT_NEAR(-t.y / t.z, 1.99, 1e-12);
}

TEST(PrimaryCamera, LookAtDoesNotMirror) {
  // The camera looks along +x from the origin with y up. In pbrt's left-handed world, right is cross(y, x) = -z.
  Camera camera = perspective(90);
  camera.world_from_camera = *look_at(DVec3(0), DVec3(1, 0, 0), DVec3(0, 2, 0));
  const PrimaryCamera primary(camera, {100, 100});
  const auto right = primary.project({10, 0, -5}), up = primary.project({10, 5, 0});
  ASSERT_TRUE(right && up);
  EXPECT_NEAR(right->pixel.x, 75.0, 1e-9);
  EXPECT_NEAR(right->pixel.y, 50.0, 1e-9);
  EXPECT_NEAR(up->pixel.x, 50.0, 1e-9);
  EXPECT_NEAR(up->pixel.y, 25.0, 1e-9);
  EXPECT_NEAR(up->view_z, 10.0, 1e-12);
}

TEST(PrimaryCamera, LookAtAlongZIsATranslation) {
  const DAffine m = *look_at(DVec3(1, 2, 3), DVec3(1, 2, 9), DVec3(0, 1, 0));
  expect_near(m[0], {1, 0, 0}, 0);
  expect_near(m[1], {0, 1, 0}, 0);
  expect_near(m[2], {0, 0, 1}, 0);
  expect_near(m[3], {1, 2, 3}, 0);
}

TEST(PrimaryCamera, MirroringTransformMirrorsTheImage) {
  Camera camera = perspective(90);
  camera.world_from_camera = DAffine(DVec3(-1, 0, 0), DVec3(0, 1, 0), DVec3(0, 0, 1), DVec3(0)); // pbrt: Scale -1 1 1
  const PrimaryCamera primary(camera, {10, 10});
  EXPECT_GT(primary.ray(0, 5).direction.x, 0.0);
  EXPECT_NEAR(primary.project({-1, 0, 2})->pixel.x, 7.5, 1e-12);
}

TEST(PrimaryCamera, ScaledCameraMeasuresDepthInWorldUnits) {
  Camera camera = perspective(60);
  camera.world_from_camera = DAffine(DVec3(3, 0, 0), DVec3(0, 3, 0), DVec3(0, 0, 3), DVec3(1, 1, 1));
  const PrimaryCamera primary(camera, {64, 32});
  EXPECT_NEAR(primary.view_z({1, 5, 8}), 7.0, 1e-12);
  EXPECT_NEAR(glm::length(primary.ray(3, 4).direction), 1.0, 1e-12);
}

TEST(PrimaryCamera, ScreenWindowShiftsTheImage) {
  Camera camera = perspective(90);
  camera.width_px = camera.height_px = 100;
  camera.screen_window = glm::dvec4(0.0, 2.0, -1.0, 1.0);
  const PrimaryCamera primary(camera, {100, 100});
  EXPECT_NEAR(primary.project({0, 0, 1})->pixel.x, 0.0, 1e-12);
  EXPECT_NEAR(primary.project({2, 1, 1})->pixel.x, 100.0, 1e-12);
  EXPECT_NEAR(primary.project({2, 1, 1})->pixel.y, 0.0, 1e-12);
}

TEST(PrimaryCamera, OtherSizeKeepsPixelShapeOfAScreenWindow) {
  Camera camera = perspective(90);
  camera.width_px = 200, camera.height_px = 100;
  camera.screen_window = glm::dvec4(-2, 2, -1, 1);
  const PrimaryCamera windowed(camera, {100, 300});
  camera.screen_window.reset();
  const PrimaryCamera plain(camera, {100, 300});
  expect_near(windowed.ray(7, 9).direction, plain.ray(7, 9).direction, 1e-12);
}

TEST(PrimaryCamera, OrthographicRaysAreParallel) {
  Camera camera;
  camera.projection = Projection::kOrthographic;
  camera.screen_window = glm::dvec4(-5, 5, -5, 5);
  camera.width_px = camera.height_px = 10;
  const PrimaryCamera primary(camera, {10, 10});
  expect_near(primary.ray(0, 0).origin, {-4.5, 4.5, 0}, 1e-12);
  expect_near(primary.ray(9, 3).direction, {0, 0, 1}, 0);
}

TEST(PrimaryCamera, EnvironmentCoversTheSphereLikePbrt) {
  Camera camera;
  camera.projection = Projection::kEnvironment;
  const PrimaryCamera primary(camera, {4, 2});
  const double theta = kPi / 4, phi = kPi / 4;
  expect_near(primary.ray(0, 0).direction,
              {std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)}, 1e-12);
  EXPECT_NEAR(primary.project({0, -3, 0})->view_z, 3.0, 1e-12);
}

TEST(PrimaryCamera, PixelsOfAnEnvironmentSpreadByTheirShorterSide) {
  Camera camera;
  camera.projection = Projection::kEnvironment;
  EXPECT_NEAR(PrimaryCamera(camera, {8, 8}).pixel_spread(), kPi / 8, 1e-12);
  EXPECT_NEAR(PrimaryCamera(camera, {32, 8}).pixel_spread(), 2 * kPi / 32, 1e-12);
}

TEST(PrimaryCamera, ProjectionInvertsRays) {
  Camera camera = perspective(35);
  camera.world_from_camera = *look_at(DVec3(3, 4, -9), DVec3(1, 0, 2), DVec3(0.1, 1, 0));
  expect_projects_back(camera, {640, 360}, 12.0);
  camera.projection = Projection::kOrthographic;
  expect_projects_back(camera, {640, 360}, 12.0);
  camera.projection = Projection::kEnvironment;
  expect_projects_back(camera, {640, 360}, 12.0);
}

TEST(PrimaryCamera, PointsBehindAPerspectiveCameraDoNotProject) {
  const PrimaryCamera camera(perspective(90), {10, 10});
  EXPECT_FALSE(camera.project({0, 0, -1}).has_value());
  EXPECT_FALSE(camera.project({1, 0, 0}).has_value());
}

TEST(PrimaryCamera, RejectsCamerasWithoutRays) {
  Camera camera = perspective(180);
  EXPECT_THROW(PrimaryCamera(camera, {8, 8}), Error);
  camera = perspective(std::nan(""));
  EXPECT_THROW(PrimaryCamera(camera, {8, 8}), Error);
  camera = perspective(60);
  EXPECT_THROW(PrimaryCamera(camera, {0, 8}), Error);
  EXPECT_THROW(PrimaryCamera(camera, {8, 70000}), Error);
  camera.world_from_camera[0] = DVec3(0);
  EXPECT_THROW(PrimaryCamera(camera, {8, 8}), Error);
  camera = perspective(60);
  camera.screen_window = glm::dvec4(1, 1, -1, 1);
  EXPECT_THROW(PrimaryCamera(camera, {8, 8}), Error);
}

TEST(FramingCamera, SeesTheWholeBoxAtAnyScale) {
  for (const double scale : {1e-30, 1.0, 1e30})
    for (const ImageSize size : {ImageSize{300, 100}, ImageSize{100, 300}}) {
      Bounds bounds;
      bounds.extend(DVec3(-1, 2, 3) * scale);
      bounds.extend(DVec3(9, 4, 8) * scale);
      const PrimaryCamera camera(framing_camera(bounds, size, {}), size);
      double widest = 0.0;
      for (int i = 0; i < 8; ++i) {
        const auto p = camera.project(
            {i & 1 ? bounds.lo.x : bounds.hi.x, i & 2 ? bounds.lo.y : bounds.hi.y, i & 4 ? bounds.lo.z : bounds.hi.z});
        ASSERT_TRUE(p.has_value());
        const glm::dvec2 from_centre = glm::abs(p->pixel / glm::dvec2(size.width, size.height) - 0.5);
        widest = std::max({widest, from_centre.x, from_centre.y});
      }
      EXPECT_LT(widest, 0.5);
      EXPECT_GT(widest, 0.4); // The bounds nearly fill the image.
    }
}

TEST(FramingCamera, WorksForEmptyAndPointBounds) {
  EXPECT_NO_THROW(PrimaryCamera(framing_camera(Bounds{}, {8, 8}, {}), {8, 8}));
  Bounds point;
  point.extend(DVec3(5, 5, 5));
  const PrimaryCamera camera(framing_camera(point, {8, 8}, {}), {8, 8});
  EXPECT_NEAR(camera.project({5, 5, 5})->pixel.x, 4.0, 1e-9);
}

Camera looking(DVec3 eye, DVec3 target, DVec3 up) {
  Camera camera;
  camera.world_from_camera = *look_at(eye, target, up);
  return camera;
}

TEST(FramingCamera, LooksFromAboveWhateverAxisIsUp) {
  Bounds bounds;
  bounds.extend(DVec3(-1, 2, 3));
  bounds.extend(DVec3(9, 4, 8));
  for (const DVec3 up : {DVec3(0, 1, 0), DVec3(0, 0, 1), DVec3(1, 0, 0), DVec3(0, -1, 0), DVec3(0, 0, -1)})
    for (const double mirror : {1.0, -1.0}) {
      std::array<Camera, 1> cameras{looking(DVec3(3, 4, 5) + 4.0 * up, DVec3(0.0), up)};
      cameras[0].world_from_camera[0] *= mirror;
      const Camera framing = framing_camera(bounds, {100, 80}, cameras);
      EXPECT_GT(glm::dot(up, framing.world_from_camera[3] - bounds.centre()), 1.0);
      const PrimaryCamera camera(framing, {100, 80});
      const glm::dvec2 top = camera.project(bounds.centre() + up).value().pixel;
      EXPECT_NEAR(top.x, 50.0, 1e-9);
      EXPECT_LT(top.y, 40.0);
      EXPECT_EQ(glm::determinant(glm::dmat3(framing.world_from_camera)) < 0.0, mirror < 0.0);
    }
}

TEST(WorldView, UpIsTheAxisWhoseImageIsVertical) {
  EXPECT_EQ(estimate_world_view({}).up, DVec3(0, 1, 0));
  // From steeply above, the camera's own up is nearer to a horizontal axis.
  for (const DVec3 up : {DVec3(0, 1, 0), DVec3(0, 0, 1), DVec3(1, 0, 0), DVec3(0, 0, -1)})
    for (const double elevation : {-0.9, -0.5, 0.0, 0.2, 0.6}) {
      const DVec3 sideways = glm::cross(up, glm::normalize(DVec3(1, 2, 4)));
      const std::array<Camera, 1> cameras{looking(DVec3(0.0), glm::normalize(sideways) + up * elevation * 1.5, up)};
      EXPECT_EQ(estimate_world_view(cameras).up, up) << elevation;
    }
}

TEST(WorldView, CamerasAlongAnAxisLookDownRatherThanUp) {
  const auto up_of = [](DVec3 eye, DVec3 up) {
    const std::array<Camera, 1> cameras{looking(eye, DVec3(0.0), up)};
    return estimate_world_view(cameras).up;
  };
  EXPECT_EQ(up_of({0, 3, -2}, {0, 1, 0}), DVec3(0, 1, 0)); // 56 degrees down
  EXPECT_EQ(up_of({0, -2, 3}, {0, 0, 1}), DVec3(0, 0, 1));
  EXPECT_EQ(up_of({0, -0.5, -3}, {0, 1, 0}), DVec3(0, 1, 0)); // 10 degrees up
}

TEST(WorldView, OtherCamerasDecideForOnesThatLookStraightDown) {
  const std::array<Camera, 2> cameras{looking({0, 2, -7}, {0, 1, 0}, {0, 1, 0}),
                                      looking({0, 8, -0.01}, {0, 0, 0}, {0, 1, 0})};
  EXPECT_EQ(estimate_world_view(cameras).up, DVec3(0, 1, 0));
  // Rolled cameras: the nearest axis.
  const std::array<Camera, 1> rolled{looking({400, 20, 30}, {0, 63, -110}, {0.1, 0.2, 1.0})};
  EXPECT_EQ(estimate_world_view(rolled).up, DVec3(0, 0, 1));
}

TEST(WorldView, IgnoresCamerasWithoutRays) {
  std::array<Camera, 2> cameras{Camera{}, looking({0, -5, 1}, {0, 0, 0}, {0, 0, 1})};
  cameras[0].world_from_camera[1] = DVec3(0.0);
  EXPECT_EQ(estimate_world_view(cameras).up, DVec3(0, 0, 1));
  cameras[0].world_from_camera[1] = DVec3(std::nan(""));
  EXPECT_EQ(estimate_world_view(cameras).up, DVec3(0, 0, 1));
}

} // namespace
} // namespace packtrace
