#include "runtime/camera/lod_view.h"

#include <algorithm>
#include <cmath>

namespace packtrace {
namespace {

constexpr double kNearDiagonals = 1e-6;
constexpr double kOrthographicReach = 1e6; // in units of the scene's diagonal plus its distance from the eye

/// Points with dot(normal, p) > offset lie outside; the normal has unit length, or is 0 if all points are inside.
struct Plane {
  DVec3 normal{0.0};
  double offset = 0.0;
};

/// Returns the plane through both rays, with `inside` on its inner side.
Plane side(const CameraRay& a, const CameraRay& b, DVec3 inside) {
  Plane plane{glm::cross(a.direction, b.origin + b.direction - a.origin), 0.0};
  const double length = glm::length(plane.normal);
  if (!(length > 0.0)) return {DVec3(0.0), 0.0}; // The image is one pixel wide: no point is outside this plane.
  plane.normal /= length;
  if (glm::dot(plane.normal, inside - a.origin) > 0.0) plane.normal = -plane.normal;
  plane.offset = glm::dot(plane.normal, a.origin);
  return plane;
}

std::vector<Plane> sides(const PrimaryCamera& camera) {
  const uint32_t right = camera.size().width - 1, bottom = camera.size().height - 1;
  const CameraRay corners[4] = {camera.ray(0, 0), camera.ray(right, 0), camera.ray(right, bottom),
                                camera.ray(0, bottom)};
  DVec3 inside(0.0);
  for (const CameraRay& corner : corners) inside += 0.25 * (corner.origin + corner.direction);
  std::vector<Plane> planes;
  for (size_t i = 0; i < 4; ++i) planes.push_back(side(corners[i], corners[(i + 1) % 4], inside));
  return planes;
}

} // namespace

DetailView detail_view(const PrimaryCamera& camera, const Bounds& world, double error_px) {
  const double diagonal = world.diagonal() > 0.0 ? world.diagonal() : 1.0;
  double near = kNearDiagonals * diagonal, spread = camera.pixel_spread();
  if (camera.projection() == Projection::kOrthographic) {
    const double distance = world.empty() ? 0.0 : glm::length(world.centre() - camera.eye());
    near = kOrthographicReach * (diagonal + distance);
    spread /= near;
  }
  const double height = camera.size().height;
  return make_detail_view(camera.eye(), near, 2.0 * std::atan(0.5 * height * spread), height, error_px);
}

double pixel_width(const PrimaryCamera& camera, DVec3 place_world) {
  const bool orthographic = camera.projection() == Projection::kOrthographic;
  return camera.pixel_spread() * (orthographic ? 1.0 : glm::length(place_world - camera.eye()));
}

double error_in_pixels(const PrimaryCamera& camera, DVec3 place_world, double error_world) {
  return error_world == 0.0 ? 0.0 : error_world / pixel_width(camera, place_world);
}

std::vector<uint8_t> outside_view(const PrimaryCamera& camera, std::span<const LodGeometry> geometries,
                                  std::span<const LodInstance> instances) {
  std::vector<uint8_t> outside(instances.size(), 0);
  if (camera.projection() == Projection::kEnvironment) return outside;
  const std::vector<Plane> planes = sides(camera);
  for (size_t i = 0; i < instances.size(); ++i) {
    const LodBall& ball = geometries[instances[i].geometry].ball();
    const DVec3 center = transform_point(instances[i].world_from_object, ball.center);
    const double radius = ball.radius * largest_stretch(instances[i].world_from_object);
    outside[i] = std::ranges::any_of(planes, [&](const Plane& plane) {
      const double slack = 1e-9 * (std::abs(plane.offset) + glm::length(center) + radius);
      return glm::dot(plane.normal, center) - plane.offset > radius + slack;
    });
  }
  return outside;
}

std::vector<uint8_t> not_in_image(const GBuffer& gbuffer, size_t count) {
  std::vector<uint8_t> unseen(count, 1);
  for (const uint32_t instance : gbuffer.instance)
    if (instance != kNoInstance) unseen[instance] = 0;
  return unseen;
}

} // namespace packtrace
