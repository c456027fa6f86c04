#pragma once

#include <optional>
#include <span>

#include "pbrt_import/scene/bounds.h"
#include "pbrt_import/scene/image_size.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// A ray in world space with a direction of unit length.
struct CameraRay {
  DVec3 origin;
  DVec3 direction;
};

/// Projection of a world point to the image.
struct ProjectedPoint {
  glm::dvec2 pixel; ///< x right, y down; the centre of pixel (i, j) is at (i + 0.5, j + 0.5)
  double view_z;    ///< camera-space depth in world units; the distance from the eye for environment cameras
};

/// A pbrt camera for an image: generates rays through pixel centres and projects points back.
/// Camera space is left-handed, +x right, +y up, +z forward; raster y points down. world_from_camera may scale or
/// mirror.
/// Source: Pharr, Jakob, Humphreys, Physically Based Rendering, 3rd ed. (2016), sections 6.1-6.3.
class PrimaryCamera {
public:
  /// @param size image size, which may differ from the film's. Without a screen window, the field of view applies to
  ///   the shorter axis of this size. With one, the window's extent along the film's shorter axis applies to the
  ///   shorter axis of this size, and the pixel aspect ratio stays.
  /// @param offset_px shift of all sample positions from pixel centres, x right, y down
  /// Throws Error(kInput) for a camera without rays (singular or non-finite transform, field of view outside (0, 180)
  /// degrees, empty screen window), Error(kUsage) for a size of zero or above 65536 on an axis.
  PrimaryCamera(const Camera& camera, ImageSize size, glm::dvec2 offset_px = glm::dvec2(0.0));

  ImageSize size() const { return size_; }

  /// The ray through the (shifted) centre of pixel (x, y).
  CameraRay ray(uint32_t x, uint32_t y) const;
  /// Does the same for other than environment cameras; inline, so that loops over pixels can be vectorised.
  CameraRay linear_ray(uint32_t x, uint32_t y) const;

  /// Projects a world point; the inverse of ray(), including its shift. Returns nullopt for points that no ray can
  /// reach (behind a perspective camera or in its plane, or at the eye). Points outside the image are projected as
  /// well.
  std::optional<ProjectedPoint> project(DVec3 world) const;
  /// Does the same for other than environment cameras, inline. If the point's view_z is not positive, a perspective
  /// camera's project() would return nullopt, and the pixel has no meaning.
  ProjectedPoint linear_projection(DVec3 world) const;

  /// Homogeneous pixel coordinates (x w, y w, w) of a world point. They are linear in the point, so that frustum planes
  /// can be tested by signs, even behind the camera, where w <= 0. Orthographic: w = 1. Not for environment cameras.
  DVec3 homogeneous_pixel(DVec3 world) const;

  /// Depth of a world point, as in ProjectedPoint::view_z; negative behind the camera.
  double view_z(DVec3 world) const;
  /// Does the same for other than environment cameras, inline.
  double linear_view_z(DVec3 world) const { return transform_point(camera_from_world_, world).z * depth_scale_; }

  Projection projection() const { return projection_; }
  const DAffine& world_from_camera() const { return world_from_camera_; }
  const DAffine& camera_from_world() const { return camera_from_world_; }
  /// World units per camera unit along camera z.
  double depth_scale() const { return depth_scale_; }
  /// Edges x0, x1, y0, y1 of the film, in the units of film_x().
  glm::dvec4 window() const { return window_; }
  glm::dvec2 offset_px() const { return offset_px_; }
  /// Film coordinates of the (shifted) centres of a column or row of pixels; not for environment cameras. Rays of
  /// perspective cameras lead from the origin of camera space through (film_x, film_y, 1).
  double film_x(uint32_t x) const {
    return window_.x + (x + 0.5 + offset_px_.x) / size_.width * (window_.y - window_.x);
  }
  double film_y(uint32_t y) const {
    return window_.w + (y + 0.5 + offset_px_.y) / size_.height * (window_.z - window_.w);
  }
  /// Origin of the rays in world space; for orthographic cameras, the origin of camera space.
  DVec3 eye() const { return world_from_camera_[3]; }
  /// World-space length that the central pixel covers at distance 1 from the eye, or at any distance for orthographic
  /// cameras. For non-square pixels or distorting transforms, the smaller length of both axes.
  double pixel_spread() const;

  bool operator==(const PrimaryCamera&) const = default;

private:
  Projection projection_;
  ImageSize size_;
  glm::dvec2 offset_px_;
  glm::dvec4 window_; ///< x0, x1, y0, y1 at z = 1; perspective: scaled by tan(fov / 2)
  DAffine world_from_camera_;
  DAffine camera_from_world_;
  double depth_scale_;
};

inline CameraRay PrimaryCamera::linear_ray(uint32_t x, uint32_t y) const {
  const DVec3 film(film_x(x), film_y(y), 0.0);
  const bool perspective = projection_ == Projection::kPerspective;
  const DVec3 origin = perspective ? DVec3(0.0) : film;
  const DVec3 direction = perspective ? DVec3(film.x, film.y, 1.0) : DVec3(0.0, 0.0, 1.0);
  return {transform_point(world_from_camera_, origin), glm::normalize(transform_vector(world_from_camera_, direction))};
}

inline ProjectedPoint PrimaryCamera::linear_projection(DVec3 world) const {
  const DVec3 c = transform_point(camera_from_world_, world);
  const glm::dvec2 film = projection_ == Projection::kPerspective ? glm::dvec2(c) / c.z : glm::dvec2(c);
  const glm::dvec2 uv((film.x - window_.x) / (window_.y - window_.x), (film.y - window_.w) / (window_.z - window_.w));
  return {uv * glm::dvec2(size_.width, size_.height) - offset_px_, c.z * depth_scale_};
}

inline DVec3 PrimaryCamera::homogeneous_pixel(DVec3 world) const {
  const DVec3 c = transform_point(camera_from_world_, world);
  const double w = projection_ == Projection::kPerspective ? c.z : 1.0;
  return {size_.width * (c.x - window_.x * w) / (window_.y - window_.x) - offset_px_.x * w,
          size_.height * (c.y - window_.w * w) / (window_.z - window_.w) - offset_px_.y * w, w};
}

/// A perspective camera that sees the whole box obliquely from above, for scenes without a camera. Works at any scale;
/// for an empty or point-like box, the distance is 1.
/// @param cameras those of the scene, which determine the up axis and whether images are mirrored (world_view.h)
Camera framing_camera(const Bounds& bounds, ImageSize size, std::span<const Camera> cameras);

} // namespace packtrace
