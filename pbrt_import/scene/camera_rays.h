#pragma once

#include <optional>

#include "pbrt_import/scene/bounds.h"
#include "pbrt_import/scene/image_size.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// A ray in world space; the direction is of unit length.
struct CameraRay {
  DVec3 origin;
  DVec3 direction;
};

/// A world point on the image.
struct ProjectedPoint {
  glm::dvec2 pixel; ///< x right, y down; the centre of pixel (i, j) is at (i + 0.5, j + 0.5)
  double view_z;    ///< camera-space depth in world units; the distance from the eye for environment cameras
};

/// A pbrt camera over an image: rays through pixel centres and back again.
/// Camera space is left-handed, +x right, +y up, +z forward; raster y runs down. world_from_camera may scale or mirror.
/// Source: Pharr, Jakob, Humphreys, Physically Based Rendering, 3rd ed. (2016), sections 6.1-6.3.
class PrimaryCamera {
public:
  /// @param size image size; need not be the film's. Without a screen window the field of view stays on the shorter
  ///   axis of this size; with one, its extent along the film's shorter axis moves to the shorter axis of this size,
  ///   and pixels keep their shape.
  /// @param offset_px shift of all sample positions from pixel centres, x right, y down
  /// Throws Error(kInput) for a camera that has no rays (singular or non-finite transform, field of view outside
  /// (0, 180) degrees, empty screen window), Error(kUsage) for a size that is zero or above 65536 on an axis.
  PrimaryCamera(const Camera& camera, ImageSize size, glm::dvec2 offset_px = glm::dvec2(0.0));

  ImageSize size() const { return size_; }

  /// The ray through the (shifted) centre of pixel (x, y).
  CameraRay ray(uint32_t x, uint32_t y) const;

  /// Where a world point appears; the inverse of ray(), its shift included. None for points that no ray can reach
  /// (behind a perspective camera or on its plane, at the eye); points outside the image are returned as they are.
  std::optional<ProjectedPoint> project(DVec3 world) const;

  /// (x w, y w, w) for the pixel (x, y) that a world point appears at: linear in the point, so half-spaces of the
  /// frustum are tests of its sign, also behind the camera, where w <= 0. Orthographic: w = 1. Not for environment
  /// cameras.
  DVec3 homogeneous_pixel(DVec3 world) const;

  /// Depth of a world point as ProjectedPoint::view_z, negative behind the camera.
  double view_z(DVec3 world) const;

  Projection projection() const { return projection_; }
  /// Where rays start, in world space; orthographic: some of them.
  DVec3 eye() const { return world_from_camera_[3]; }
  /// World length that one pixel in the middle of the image covers at distance 1 from the eye; orthographic: at any.
  /// Where pixels are not square, or the camera's transform distorts, the smaller one of both axes.
  double pixel_spread() const;

  bool operator==(const PrimaryCamera&) const = default;

private:
  Projection projection_;
  ImageSize size_;
  glm::dvec2 offset_px_;
  glm::dvec4 window_; ///< x0, x1, y0, y1 at z = 1 (perspective: tan of half the field of view included)
  DAffine world_from_camera_;
  DAffine camera_from_world_;
  double depth_scale_; ///< world units per camera unit along camera z
};

/// A perspective camera that sees all of a box from in front, above and to the right (world +y up), for scenes
/// without a camera. Works for any scale; an empty or point-like box gets a unit distance.
Camera framing_camera(const Bounds& bounds, ImageSize size);

} // namespace packtrace
