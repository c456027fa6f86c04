#include "runtime/camera/ray_columns.h"

#include <limits>

#include "runtime/simd.h"
#include "runtime/trace/ray_offset.h"

namespace packtrace {
namespace {

bool is_linear(const PrimaryCamera& camera) { return camera.projection() != Projection::kEnvironment; }

PACKTRACE_AVX2_CLONES
void write_linear_rays(const PrimaryCamera& pixels, const UnitSpace& unit, uint32_t count, RayColumns& columns) {
  const PrimaryCamera camera = pixels; // local copies, which the stores below cannot change
  const UnitSpace space = unit;
#pragma GCC ivdep
  for (uint32_t i = 0; i < count; ++i) {
    const CameraRay ray = camera.linear_ray(columns.x[i], columns.y[i]);
    columns.origin.set(i, space.to_unit(ray.origin));
    columns.direction.set(i, ray.direction);
  }
}

/// Returns the intersection of the ray with the surface's plane. Barycentrics are floats: on a large triangle the
/// point that they yield is on the plane but off the pixel's ray. Where the ray grazes the plane, or the intersection
/// is far from that point, that point is used.
DVec3 on_ray(DVec3 origin, DVec3 direction, DVec3 from_barycentrics, DVec3 normal) {
  constexpr double kMinCosine = 1e-3, kMaxMove = 0x1p-20 * UnitSpace::kHalfSize;
  const double cosine = glm::dot(normal, direction);
  const double t = glm::dot(normal, from_barycentrics - origin) / cosine;
  const DVec3 point = origin + direction * t;
  const DVec3 move = point - from_barycentrics;
  const bool near = (cosine < -kMinCosine) & (glm::dot(move, move) <= kMaxMove * kMaxMove);
  return {near ? point.x : from_barycentrics.x, near ? point.y : from_barycentrics.y,
          near ? point.z : from_barycentrics.z};
}

/// Returns the unit normal that faces the ray's origin; the reversed ray direction if the triangle has no area.
DVec3 facing_normal(DVec3 normal, DVec3 direction) {
  const double length = glm::length(normal);
  const double scale = (glm::dot(normal, direction) > 0.0 ? -1.0 : 1.0) / length;
  const bool has_area = length > 0.0;
  return {has_area ? normal.x * scale : -direction.x, has_area ? normal.y * scale : -direction.y,
          has_area ? normal.z * scale : -direction.z};
}

PACKTRACE_AVX2_CLONES
void write_linear_depths(const PrimaryCamera& pixels, uint32_t count, RayColumns& columns) {
  const PrimaryCamera camera = pixels;
#pragma GCC ivdep
  for (uint32_t i = 0; i < count; ++i) columns.view_z[i] = camera.linear_view_z(columns.position.at(i));
}

PACKTRACE_AVX2_CLONES
void project_points(const PrimaryCamera& before, double no_motion_px, uint32_t count, RayColumns& columns) {
  const PrimaryCamera previous = before;
  const bool perspective = previous.projection() == Projection::kPerspective;
#pragma GCC ivdep
  for (uint32_t i = 0; i < count; ++i) {
    const ProjectedPoint then = previous.linear_projection(columns.position.at(i));
    const bool behind = perspective & !(then.view_z > 0.0);
    const double x = columns.x[i] + 0.5 - then.pixel.x, y = columns.y[i] + 0.5 - then.pixel.y;
    columns.motion_x[i] = behind ? no_motion_px : glm::clamp(x, -no_motion_px, no_motion_px);
    columns.motion_y[i] = behind ? no_motion_px : glm::clamp(y, -no_motion_px, no_motion_px);
    columns.previous_z[i] = behind ? 0.0 : then.view_z;
  }
}

} // namespace

void write_rays(const PrimaryCamera& camera, const UnitSpace& space, uint32_t count, RayColumns& columns) {
  if (is_linear(camera)) return write_linear_rays(camera, space, count, columns);
  for (uint32_t i = 0; i < count; ++i) {
    const CameraRay ray = camera.ray(columns.x[i], columns.y[i]);
    columns.origin.set(i, space.to_unit(ray.origin));
    columns.direction.set(i, ray.direction);
  }
}

PACKTRACE_AVX2_CLONES
void span_triangles(uint32_t count, RayColumns& columns) {
#pragma GCC ivdep
  for (uint32_t i = 0; i < count; ++i) {
    const auto vertex = [&](int corner) {
      return DVec3(columns.vertex[corner][0][i], columns.vertex[corner][1][i], columns.vertex[corner][2][i]);
    };
    const DVec3 v0 = vertex(0), e1 = vertex(1) - v0, e2 = vertex(2) - v0;
    columns.own_normal.set(i, glm::cross(e1, e2));
    columns.from_barycentrics.set(i, v0 + e1 * double{columns.u[i]} + e2 * double{columns.v[i]});
  }
}

PACKTRACE_AVX2_CLONES
void meet_planes(uint32_t count, RayColumns& columns) {
#pragma GCC ivdep
  for (uint32_t i = 0; i < count; ++i) {
    const DVec3 direction = columns.direction.at(i);
    const DVec3 normal = facing_normal(columns.own_normal.at(i), direction);
    columns.normal.set(i, normal);
    columns.point.set(i, on_ray(columns.origin.at(i), direction, columns.from_barycentrics.at(i), normal));
  }
}

PACKTRACE_AVX2_CLONES
void place_points(const PrimaryCamera& camera, const UnitSpace& unit, uint32_t count, RayColumns& columns) {
  // Positions are rounded to multiples of the least denormal float, and so are sums of position and offset.
  constexpr double kMinOffset = 4.0 * double{std::numeric_limits<float>::denorm_min()};
  const UnitSpace space = unit;
#pragma GCC ivdep
  for (uint32_t i = 0; i < count; ++i) {
    const DVec3 point = columns.point.at(i);
    const auto largest = [&](int axis) {
      const double v0 = columns.vertex[0][axis][i], v1 = columns.vertex[1][axis][i], v2 = columns.vertex[2][axis][i];
      return columns.instanced[i] != 0 ? 0.0 : glm::max(glm::max(glm::abs(v0), glm::abs(v1)), glm::abs(v2));
    };
    const double offset = ray_offset(DVec3(largest(0), largest(1), largest(2)), columns.surface_offset[i], space, point,
                                     columns.normal.at(i));
    columns.position.set(i, space.from_unit(point));
    columns.offset[i] = glm::max(offset * space.inverse_scale(), kMinOffset);
  }
  if (is_linear(camera)) return write_linear_depths(camera, count, columns);
  for (uint32_t i = 0; i < count; ++i) columns.view_z[i] = camera.view_z(columns.position.at(i));
}

void move_with_camera(const PrimaryCamera& previous, double no_motion_px, uint32_t count, RayColumns& columns) {
  if (is_linear(previous)) return project_points(previous, no_motion_px, count, columns);
  for (uint32_t i = 0; i < count; ++i) {
    const std::optional<ProjectedPoint> then = previous.project(columns.position.at(i));
    const auto motion = [&](double now, double before) {
      return then ? glm::clamp(now - before, -no_motion_px, no_motion_px) : no_motion_px;
    };
    columns.motion_x[i] = motion(columns.x[i] + 0.5, then ? then->pixel.x : 0.0);
    columns.motion_y[i] = motion(columns.y[i] + 0.5, then ? then->pixel.y : 0.0);
    columns.previous_z[i] = then ? then->view_z : 0.0;
  }
}

} // namespace packtrace
