#include "pbrt_import/scene/camera_rays.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "pbrt_import/base/error.h"
#include "pbrt_import/scene/world_view.h"

namespace packtrace {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr uint32_t kMaxAxis = 65536;

bool is_finite(const DAffine& m) {
  return packtrace::is_finite(DVec3(m[0])) && packtrace::is_finite(DVec3(m[1])) && packtrace::is_finite(DVec3(m[2])) &&
         packtrace::is_finite(DVec3(m[3]));
}

void require(bool condition, const char* message) {
  if (!condition) throw Error(ErrorKind::kInput, message);
}

glm::dvec4 default_window(ImageSize size) {
  const double aspect = double(size.width) / double(size.height);
  return aspect >= 1.0 ? glm::dvec4(-aspect, aspect, -1.0, 1.0) : glm::dvec4(-1.0, 1.0, -1.0 / aspect, 1.0 / aspect);
}

/// The screen window of the film, adapted if the image size differs from the film's.
glm::dvec4 window_for(const Camera& camera, ImageSize size) {
  if (!camera.screen_window) return default_window(size);
  const glm::dvec4 window = *camera.screen_window;
  if ((size.width == camera.width_px && size.height == camera.height_px) || !camera.width_px || !camera.height_px)
    return window;
  const double width = window.y - window.x, height = window.w - window.z;
  const double pixel_aspect = (width / camera.width_px) / (height / camera.height_px);
  const double shorter = camera.width_px >= camera.height_px ? height : width / pixel_aspect;
  const double aspect = double(size.width) / double(size.height);
  const double new_height = aspect >= 1.0 ? shorter : shorter / aspect;
  const double new_width = new_height * aspect * pixel_aspect;
  const double x = (window.x + window.y) / 2, y = (window.z + window.w) / 2;
  return {x - new_width / 2, x + new_width / 2, y - new_height / 2, y + new_height / 2};
}

} // namespace

PrimaryCamera::PrimaryCamera(const Camera& camera, ImageSize size, glm::dvec2 offset_px)
    : projection_(camera.projection), size_(size), offset_px_(offset_px), window_(0.0),
      world_from_camera_(camera.world_from_camera), camera_from_world_(1.0), depth_scale_(1.0) {
  if (size.width == 0 || size.height == 0 || size.width > kMaxAxis || size.height > kMaxAxis)
    throw Error(ErrorKind::kUsage, "the image size must be 1 to 65536 pixels on each axis");
  require(is_finite(world_from_camera_), "the camera's transform is not finite");
  camera_from_world_ = inverse(world_from_camera_);
  require(is_finite(camera_from_world_) && glm::determinant(glm::dmat3(world_from_camera_)) != 0.0,
          "the camera's transform is singular");
  depth_scale_ = glm::length(world_from_camera_[2]);

  window_ = window_for(camera, size);
  const double width = window_.y - window_.x, height = window_.w - window_.z;
  require(std::isfinite(width) && std::isfinite(height) && width != 0.0 && height != 0.0,
          "the camera's screen window is empty or not finite");
  if (projection_ == Projection::kPerspective) {
    require(camera.fov_degrees > 0.0 && camera.fov_degrees < 180.0, "the camera's fov must lie between 0 and 180");
    window_ *= std::tan(camera.fov_degrees * kPi / 360.0);
  }
}

CameraRay PrimaryCamera::ray(uint32_t x, uint32_t y) const {
  if (projection_ != Projection::kEnvironment) return linear_ray(x, y);
  const double theta = kPi * ((y + 0.5 + offset_px_.y) / size_.height);
  const double phi = 2 * kPi * ((x + 0.5 + offset_px_.x) / size_.width);
  const DVec3 direction(std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi));
  return {transform_point(world_from_camera_, DVec3(0.0)),
          glm::normalize(transform_vector(world_from_camera_, direction))};
}

double PrimaryCamera::pixel_spread() const {
  const glm::dmat3 linear(world_from_camera_);
  if (projection_ == Projection::kEnvironment) return std::min(2.0 * kPi / size_.width, kPi / size_.height);
  const double width = std::abs(window_.y - window_.x) / size_.width;
  const double height = std::abs(window_.w - window_.z) / size_.height;
  const double depth = projection_ == Projection::kPerspective ? depth_scale_ : 1.0;
  return std::min(glm::length(linear[0]) * width, glm::length(linear[1]) * height) / depth;
}

double PrimaryCamera::view_z(DVec3 world) const {
  if (projection_ == Projection::kEnvironment) return glm::length(world - world_from_camera_[3]);
  return linear_view_z(world);
}

std::optional<ProjectedPoint> PrimaryCamera::project(DVec3 world) const {
  if (projection_ != Projection::kEnvironment) {
    const ProjectedPoint point = linear_projection(world);
    if (projection_ == Projection::kPerspective && !(point.view_z > 0.0)) return std::nullopt;
    return point;
  }
  const DVec3 c = transform_point(camera_from_world_, world);
  const double distance = glm::length(c);
  if (!(distance > 0.0)) return std::nullopt;
  const double phi = std::atan2(c.z, c.x);
  const glm::dvec2 uv((phi < 0 ? phi + 2 * kPi : phi) / (2 * kPi),
                      std::acos(std::clamp(c.y / distance, -1.0, 1.0)) / kPi);
  return ProjectedPoint{uv * glm::dvec2(size_.width, size_.height) - offset_px_, view_z(world)};
}

Camera framing_camera(const Bounds& bounds, ImageSize size, std::span<const Camera> cameras) {
  const WorldView world = estimate_world_view(cameras);
  Camera camera;
  camera.width_px = size.width;
  camera.height_px = size.height;
  camera.fov_degrees = 40.0;
  const DVec3 centre = bounds.empty() ? DVec3(0.0) : bounds.centre();
  const DVec3 front = world.up.z == 0.0 ? DVec3(0, 0, -1) : DVec3(0, -1, 0), side = glm::cross(front, world.up);
  camera.world_from_camera = *look_at(0.6 * side + 0.5 * world.up + front, DVec3(0.0), world.up);
  if (world.mirrored) camera.world_from_camera[0] = -camera.world_from_camera[0];

  // The smallest distance at which every corner of the box lies inside the frustum, plus a margin.
  const glm::dvec4 window = default_window(size);
  const double tangent = std::tan(camera.fov_degrees * kPi / 360.0);
  const DVec3 half = bounds.extent() * 0.5;
  double distance = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const DVec3 p = half * DVec3(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    const DVec3 axes[3] = {camera.world_from_camera[0], camera.world_from_camera[1], camera.world_from_camera[2]};
    const double x = std::abs(glm::dot(p, axes[0])), y = std::abs(glm::dot(p, axes[1])), z = glm::dot(p, axes[2]);
    distance = std::max({distance, x / (window.y * tangent) - z, y / (window.w * tangent) - z});
  }
  distance = distance > 0.0 ? distance * 1.08 : 1.0;
  camera.world_from_camera[3] = centre - distance * DVec3(camera.world_from_camera[2]);
  return camera;
}

} // namespace packtrace
