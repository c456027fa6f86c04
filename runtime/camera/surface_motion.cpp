#include "runtime/camera/surface_motion.h"

#include <string>

#include "pbrt_import/base/error.h"

namespace packtrace {

SurfaceMotion::SurfaceMotion(const SceneSource& source, const RayTracer& tracer, const PrimaryCamera& now,
                             const PreviousFrame& previous)
    : source_(source), tracer_(tracer), previous_(previous), placed_(tracer.world_from_object()),
      camera_moved_(!(now == previous.camera)),
      any_(camera_moved_ || !previous.world_from_object.empty() || previous.surfaces != nullptr) {
  const size_t given = previous.world_from_object.size(), instances = source.instances().size();
  if (given != 0 && given != instances)
    throw Error(ErrorKind::kUsage, "the previous frame has transforms of " + std::to_string(given) +
                                       " instances, not of " + std::to_string(instances));
}

std::pair<Vec2, float> SurfaceMotion::of(const SurfacePoint& point) const {
  const RayColumns& c = point.columns;
  const std::optional<DVec3> elsewhere = previous_position(point);
  if (!elsewhere && !camera_moved_) return {Vec2(0), point.view_z};
  if (!elsewhere)
    return {Vec2(c.motion_x[point.ray], c.motion_y[point.ray]), static_cast<float>(c.previous_z[point.ray])};
  const std::optional<ProjectedPoint> before = previous_.camera.project(*elsewhere);
  if (!before) return {Vec2(kNoMotionPx), 0.0f};
  const glm::dvec2 now = glm::dvec2(c.x[point.ray], c.y[point.ray]) + 0.5;
  return {Vec2(glm::clamp(now - before->pixel, -double(kNoMotionPx), double(kNoMotionPx))),
          static_cast<float>(before->view_z)};
}

/// Returns where the point was, in world space; none if it did not move.
std::optional<DVec3> SurfaceMotion::previous_position(const SurfacePoint& point) const {
  if (previous_.world_from_object.empty() && previous_.surfaces == nullptr) return std::nullopt;
  const uint32_t instance = point.surface.placement->instance;
  const Affine& now = world_from_object(instance);
  const Affine& before = previous_.world_from_object.empty() ? now : previous_.world_from_object[instance];
  const bool moved = !(before == now);
  if (!moved && previous_.surfaces == nullptr) return std::nullopt;
  const glm::dvec2 barycentrics = exact_barycentrics(point);
  if (previous_.surfaces != nullptr)
    if (const std::optional<DVec3> deformed =
            previous_.surfaces->previous_position(instance, point.surface.triangle, barycentrics))
      return transform_point(DAffine(before), *deformed);
  if (!moved) return std::nullopt;
  const std::array<DVec3, 3> v = tracer_.object_vertices(point.hit, point.surface);
  const DVec3 object = v[0] + (v[1] - v[0]) * barycentrics.x + (v[2] - v[0]) * barycentrics.y;
  return transform_point(DAffine(before), object);
}

/// The barycentrics of a hit are floats. On large triangles the pixel's point differs from the one that they yield.
glm::dvec2 SurfaceMotion::exact_barycentrics(const SurfacePoint& point) const {
  const HitSurface& surface = point.surface;
  const glm::dvec2 rounded(point.hit.u, point.hit.v);
  const DVec3 v0(surface.vertices[0]);
  DVec3 e1 = DVec3(surface.vertices[1]) - v0, e2 = DVec3(surface.vertices[2]) - v0;
  if (surface.placement->instanced) {
    e1 = transform_vector(surface.placement->unit_from_surface, e1);
    e2 = transform_vector(surface.placement->unit_from_surface, e2);
  }
  const double a = glm::dot(e1, e1), b = glm::dot(e1, e2), c = glm::dot(e2, e2), determinant = a * c - b * b;
  const DVec3 from_hit = point.columns.point.at(point.ray) - point.columns.from_barycentrics.at(point.ray);
  const double x = glm::dot(e1, from_hit), y = glm::dot(e2, from_hit);
  // For a sliver the correction is as uncertain as the barycentrics.
  constexpr double kMinSine2 = 1e-12;
  if (!(determinant > kMinSine2 * a * c)) return rounded;
  return rounded + glm::dvec2(c * x - b * y, a * y - b * x) / determinant;
}

const Affine& SurfaceMotion::world_from_object(uint32_t instance) const {
  return placed_.empty() ? source_.instances()[instance].world_from_object : placed_[instance];
}

} // namespace packtrace
