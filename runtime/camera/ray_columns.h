#pragma once

#include <array>
#include <cstdint>

#include "pbrt_import/scene/camera_rays.h"
#include "runtime/trace/ray_tracer.h"

namespace packtrace {

inline constexpr uint32_t kMaxColumnRays = 128; ///< small enough for the level-2 cache

/// Vectors in columns, for loops that are vectorised.
struct VectorColumns {
  double x[kMaxColumnRays], y[kMaxColumnRays], z[kMaxColumnRays];
  DVec3 at(uint32_t i) const { return {x[i], y[i], z[i]}; }
  void set(uint32_t i, DVec3 v) { x[i] = v.x, y[i] = v.y, z[i] = v.z; }
};

/// Triangles in columns.
struct TriangleColumns {
  double vertex[3][3][kMaxColumnRays]; ///< by corner and axis, in the surface's coordinates
  float normal[3][3][kMaxColumnRays];  ///< of the vertices, by corner and axis, in object space; without normals 0

  void set(uint32_t i, const Vec3 (&vertices)[3], const std::array<Vec3, 3>& normals) {
    for (int corner = 0; corner < 3; ++corner)
      for (int axis = 0; axis < 3; ++axis)
        vertex[corner][axis][i] = vertices[corner][axis], normal[corner][axis][i] = normals[corner][axis];
  }
};

/// Camera rays of a batch and the surface points that they hit, in columns with an element per ray. Rays that miss hold
/// values without meaning. The functions below fill the columns in their order; elements are a range that begins at
/// `first`, or at 0, and ends within kMaxColumnRays. Their results have the same bits for every instruction set.
struct RayColumns {
  uint32_t x[kMaxColumnRays], y[kMaxColumnRays]; ///< pixels
  VectorColumns origin, direction;               ///< of the rays, unit space
  int32_t hit[kMaxColumnRays];                   ///< whether they hit a surface; 0 or 1
  int32_t triangle[kMaxColumnRays];              ///< the triangle that was hit, in TriangleColumns; of a miss any
  float u[kMaxColumnRays], v[kMaxColumnRays];    ///< weights of the second and third vertex
  double vertex[3][3][kMaxColumnRays];           ///< as in TriangleColumns
  double weight[2][kMaxColumnRays];              ///< u and v
  VectorColumns from_barycentrics;               ///< the point that u and v yield, unit space
  VectorColumns normal;                          ///< unit vector that faces the ray's origin, unit space
  double winding[kMaxColumnRays];                ///< negative where the triangle's own normal points away
  VectorColumns point;                           ///< unit space
  VectorColumns position;                        ///< of the point in world space
  double view_z[kMaxColumnRays], offset[kMaxColumnRays]; ///< as in GBuffer
  float object_normal[3][kMaxColumnRays];                ///< by axis: shading normal, object space
  int32_t has_normal[kMaxColumnRays];                    ///< whether there is one; 0 or 1
  float shading_normal[3][kMaxColumnRays];               ///< by axis: world space, unit length, on the side of `normal`
  double motion_x[kMaxColumnRays], motion_y[kMaxColumnRays], previous_z[kMaxColumnRays]; ///< of points at rest
};

/// Writes the rays of pixels: origin, direction.
void write_rays(const PrimaryCamera& camera, const UnitSpace& space, uint32_t count, RayColumns& columns);

/// Whether all rays start so near to the scene that approach_scene() leaves them as they are.
bool start_near(uint32_t count, const RayColumns& columns);

/// Writes vertex and weight. Needs triangle, u and v.
void gather_vertices(const TriangleColumns& triangles, uint32_t count, RayColumns& columns);

/// Writes object_normal and has_normal: the normals that interpolated_normal() returns. Needs triangle, u and v.
void interpolate_normals(const TriangleColumns& triangles, uint32_t count, RayColumns& columns);

/// Writes from_barycentrics, normal, winding, point, position and offset of rays that hit surfaces of one placement.
void meet_surfaces(const Placement& placement, const UnitSpace& space, uint32_t first, uint32_t count,
                   RayColumns& columns);

/// Writes shading_normal of rays that hit surfaces of one placement.
/// @param object_normal Placement::object_normal
void face_normals(const glm::dmat3& object_normal, uint32_t first, uint32_t count, RayColumns& columns);

/// Writes view_z.
void write_depths(const PrimaryCamera& camera, uint32_t count, RayColumns& columns);

/// Writes the motion of points at rest since the previous camera: the pixels' centres minus the points' projections.
/// @param no_motion_px motion per axis of points that it cannot project, and the longest of others; their depth is 0
void move_with_camera(const PrimaryCamera& previous, double no_motion_px, uint32_t count, RayColumns& columns);

} // namespace packtrace
