#pragma once

#include <utility>

#include "runtime/camera/primary_visibility.h"
#include "runtime/camera/ray_columns.h"

namespace packtrace {

/// A point that a camera ray hit.
struct SurfacePoint {
  const RayHit& hit;
  const HitSurface& surface;
  float view_z;
  uint32_t ray;              ///< in the columns
  const RayColumns& columns; ///< after SurfaceMotion::move_with_camera()
};

/// Motion of surface points since the previous frame.
class SurfaceMotion {
public:
  /// Throws Error(kUsage) for previous transforms that are not one per instance.
  SurfaceMotion(const SceneSource& source, const RayTracer& tracer, const PrimaryCamera& now,
                const PreviousFrame& previous);

  /// False if nothing moved: motion is zero everywhere.
  bool any() const { return any_; }

  bool camera_moved() const { return camera_moved_; }
  /// Whether surfaces may have moved: of() then differs from what move_with_camera() writes.
  bool of_surfaces() const { return !previous_.world_from_object.empty() || previous_.surfaces != nullptr; }

  /// Writes the motion of all points as if only the camera had moved.
  void move_with_camera(uint32_t count, RayColumns& columns) const {
    if (camera_moved_) packtrace::move_with_camera(previous_.camera, double{kNoMotionPx}, count, columns);
  }

  /// Returns GBuffer::motion_px and GBuffer::previous_z.
  std::pair<Vec2, float> of(const SurfacePoint& point) const;

private:
  std::optional<DVec3> previous_position(const SurfacePoint& point) const;
  glm::dvec2 exact_barycentrics(const SurfacePoint& point) const;
  const Affine& world_from_object(uint32_t instance) const;

  const SceneSource& source_;
  const RayTracer& tracer_;
  const PreviousFrame previous_;
  const std::span<const Affine> placed_; ///< by instance; empty: as in the source
  bool camera_moved_, any_;
};

} // namespace packtrace
