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
  // A number in place of a bool, which would narrow the lanes of vectorised loops to bytes.
  const double squared = cosine < -kMinCosine ? glm::dot(move, move) : std::numeric_limits<double>::infinity();
  constexpr double kMax = kMaxMove * kMaxMove;
  return {squared <= kMax ? point.x : from_barycentrics.x, squared <= kMax ? point.y : from_barycentrics.y,
          squared <= kMax ? point.z : from_barycentrics.z};
}

/// Returns the unit normal that faces the ray's origin; the reversed ray direction if the triangle has no area.
DVec3 facing_normal(DVec3 normal, DVec3 direction) {
  const double length = glm::length(normal);
  const double scale = (glm::dot(normal, direction) > 0.0 ? -1.0 : 1.0) / length;
  return {length > 0.0 ? normal.x * scale : -direction.x, length > 0.0 ? normal.y * scale : -direction.y,
          length > 0.0 ? normal.z * scale : -direction.z};
}

/// Kinds of placements.
enum class PlacementKind {
  kDirect,  ///< not instanced
  kExact,   ///< bounds of moved coordinates are 0
  kRounded, ///< they are not
};

template <PlacementKind kKind>
[[gnu::always_inline]] inline void meet(const Placement& placement, const UnitSpace& unit, uint32_t first,
                                        uint32_t count, RayColumns& columns) {
  // Positions are rounded to multiples of the least denormal float, and so are sums of position and offset.
  constexpr double kMinOffset = 4.0 * double{std::numeric_limits<float>::denorm_min()};
  constexpr bool kInstanced = kKind != PlacementKind::kDirect;
  const UnitSpace space = unit; // local copies, which the stores below cannot change
  const DAffine unit_from_surface = placement.unit_from_surface;
  const glm::dmat3 linear(unit_from_surface), surface_normal = placement.surface_normal;
  const glm::dmat3 moved_linear = placement.moved_linear;
  const DVec3 moved_offset = placement.moved_offset;
#pragma GCC ivdep
  for (uint32_t i = first; i < first + count; ++i) {
    const auto vertex = [&](int corner) {
      return DVec3(columns.vertex[corner][0][i], columns.vertex[corner][1][i], columns.vertex[corner][2][i]);
    };
    const DVec3 v0 = vertex(0), v1 = vertex(1), v2 = vertex(2), e1 = v1 - v0, e2 = v2 - v0;
    const DVec3 largest = glm::max(glm::max(magnitudes(v0), magnitudes(v1)), magnitudes(v2));
    DVec3 own_normal = glm::cross(e1, e2);
    DVec3 from_barycentrics = v0 + e1 * columns.weight[0][i] + e2 * columns.weight[1][i];
    if constexpr (kInstanced) {
      own_normal = surface_normal * own_normal;
      from_barycentrics = transform_point(unit_from_surface, from_barycentrics);
    }
    const DVec3 direction = columns.direction.at(i);
    const DVec3 normal = facing_normal(own_normal, direction);
    const DVec3 point = on_ray(columns.origin.at(i), direction, from_barycentrics, normal);
    double in_surface = 0.0;
    if constexpr (kKind == PlacementKind::kExact) in_surface = surface_offset(largest, linear, normal);
    if constexpr (kKind == PlacementKind::kRounded)
      in_surface = surface_offset(glm::max(moved_linear * magnitudes(point) + moved_offset, largest), linear, normal);
    const double offset = ray_offset(kInstanced ? DVec3(0.0) : largest, in_surface, space, point, normal);
    columns.from_barycentrics.set(i, from_barycentrics);
    columns.normal.set(i, normal);
    columns.winding[i] = glm::dot(own_normal, normal);
    columns.point.set(i, point);
    columns.position.set(i, space.from_unit(point));
    columns.offset[i] = glm::max(offset * space.inverse_scale(), kMinOffset);
  }
}

PACKTRACE_AVX2_CLONES
void meet_direct(const Placement& placement, const UnitSpace& space, uint32_t first, uint32_t count,
                 RayColumns& columns) {
  meet<PlacementKind::kDirect>(placement, space, first, count, columns);
}

PACKTRACE_AVX2_CLONES
void meet_exact(const Placement& placement, const UnitSpace& space, uint32_t first, uint32_t count,
                RayColumns& columns) {
  meet<PlacementKind::kExact>(placement, space, first, count, columns);
}

PACKTRACE_AVX2_CLONES
void meet_rounded(const Placement& placement, const UnitSpace& space, uint32_t first, uint32_t count,
                  RayColumns& columns) {
  meet<PlacementKind::kRounded>(placement, space, first, count, columns);
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
bool start_near(uint32_t count, const RayColumns& columns) {
  constexpr double kNear = UnitSpace::kNear;
  uint64_t far = 0;
  for (uint32_t i = 0; i < count; ++i) {
    const DVec3 origin = columns.origin.at(i);
    far |= glm::dot(origin, origin) <= kNear * kNear ? uint64_t{0} : uint64_t{1};
  }
  return far == 0;
}

PACKTRACE_AVX2_CLONES
void gather_vertices(const TriangleColumns& triangles, uint32_t count, RayColumns& columns) {
  for (int corner = 0; corner < 3; ++corner)
    for (int axis = 0; axis < 3; ++axis) {
      const double* const from = triangles.vertex[corner][axis];
      double* const to = columns.vertex[corner][axis];
#pragma GCC ivdep
      for (uint32_t i = 0; i < count; ++i) to[i] = from[columns.triangle[i]];
    }
#pragma GCC ivdep
  for (uint32_t i = 0; i < count; ++i) columns.weight[0][i] = columns.u[i], columns.weight[1][i] = columns.v[i];
}

PACKTRACE_AVX2_CLONES
void interpolate_normals(const TriangleColumns& triangles, uint32_t count, RayColumns& columns) {
#pragma GCC ivdep
  for (uint32_t i = 0; i < count; ++i) {
    const int32_t t = columns.triangle[i];
    const auto corner = [&](int c) {
      return Vec3(triangles.normal[c][0][t], triangles.normal[c][1][t], triangles.normal[c][2][t]);
    };
    const Vec3 n = interpolated_normal(corner(0), corner(1), corner(2), columns.u[i], columns.v[i]);
    const float length = glm::length(n);
    columns.object_normal[0][i] = n.x / length;
    columns.object_normal[1][i] = n.y / length;
    columns.object_normal[2][i] = n.z / length;
    columns.has_normal[i] = length > 0.0f ? 1 : 0; // opposite vertex normals cancel
  }
}

void meet_surfaces(const Placement& placement, const UnitSpace& space, uint32_t first, uint32_t count,
                   RayColumns& columns) {
  if (!placement.instanced) return meet_direct(placement, space, first, count, columns);
  const bool exact = placement.moved_linear == glm::dmat3(0.0) && placement.moved_offset == DVec3(0.0);
  (exact ? meet_exact : meet_rounded)(placement, space, first, count, columns);
}

PACKTRACE_AVX2_CLONES
void face_normals(const glm::dmat3& object_normal, uint32_t first, uint32_t count, RayColumns& columns) {
  const glm::dmat3 to_world = object_normal;
#pragma GCC ivdep
  for (uint32_t i = first; i < first + count; ++i) {
    const DVec3 geometric = columns.normal.at(i);
    const DVec3 normal =
        to_world * DVec3(columns.object_normal[0][i], columns.object_normal[1][i], columns.object_normal[2][i]);
    const double length = glm::length(normal);
    const double scale = (glm::dot(normal, geometric) < 0.0 ? -1.0 : 1.0) / length;
    const double shaded = length > 0.0 ? columns.has_normal[i] : 0;
    columns.shading_normal[0][i] = static_cast<float>(shaded != 0.0 ? normal.x * scale : geometric.x);
    columns.shading_normal[1][i] = static_cast<float>(shaded != 0.0 ? normal.y * scale : geometric.y);
    columns.shading_normal[2][i] = static_cast<float>(shaded != 0.0 ? normal.z * scale : geometric.z);
  }
}

void write_depths(const PrimaryCamera& camera, uint32_t count, RayColumns& columns) {
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
