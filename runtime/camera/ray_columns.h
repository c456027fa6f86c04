#pragma once

#include <cstdint>

#include "pbrt_import/scene/camera_rays.h"
#include "runtime/trace/unit_space.h"

namespace packtrace {

inline constexpr uint32_t kMaxColumnRays = 128; ///< small enough for the level-2 cache

/// Vectors in columns, for loops that are vectorised.
struct VectorColumns {
  double x[kMaxColumnRays], y[kMaxColumnRays], z[kMaxColumnRays];
  DVec3 at(uint32_t i) const { return {x[i], y[i], z[i]}; }
  void set(uint32_t i, DVec3 v) { x[i] = v.x, y[i] = v.y, z[i] = v.z; }
};

/// Camera rays of a batch and the surface points that they hit, in columns with an element per ray. Rays that miss hold
/// finite values without meaning. The functions below fill the columns in their order; `count` is at most
/// kMaxColumnRays. Their results have the same bits for every instruction set.
struct RayColumns {
  uint32_t x[kMaxColumnRays], y[kMaxColumnRays]; ///< pixels
  VectorColumns origin, direction;               ///< of the rays, unit space
  float vertex[3][3][kMaxColumnRays];            ///< of the triangles by corner and axis, in the surface's coordinates
  float u[kMaxColumnRays], v[kMaxColumnRays];    ///< weights of the second and third vertex
  uint8_t instanced[kMaxColumnRays];             ///< Placement::instanced, 0 or 1
  VectorColumns own_normal;                      ///< cross product of the edges, then also in unit space
  VectorColumns from_barycentrics;               ///< the point in the surface's coordinates, then in unit space
  VectorColumns normal;                          ///< unit vector that faces the ray's origin, unit space
  VectorColumns point;                           ///< unit space
  double surface_offset[kMaxColumnRays];         ///< surface_offset() of instanced placements, else 0
  VectorColumns position;                        ///< of the point in world space
  double view_z[kMaxColumnRays], offset[kMaxColumnRays];                                 ///< as in GBuffer
  double motion_x[kMaxColumnRays], motion_y[kMaxColumnRays], previous_z[kMaxColumnRays]; ///< of points at rest
};

/// Writes the rays of pixels: origin, direction.
void write_rays(const PrimaryCamera& camera, const UnitSpace& space, uint32_t count, RayColumns& columns);

/// Writes own_normal and from_barycentrics in the surface's coordinates. The caller transforms those of instanced
/// placements to unit space.
void span_triangles(uint32_t count, RayColumns& columns);

/// Writes normal and point.
void meet_planes(uint32_t count, RayColumns& columns);

/// Writes position, view_z and offset. Needs surface_offset.
void place_points(const PrimaryCamera& camera, const UnitSpace& space, uint32_t count, RayColumns& columns);

/// Writes the motion of points at rest since the previous camera: the pixels' centres minus the points' projections.
/// @param no_motion_px motion per axis of points that it cannot project, and the longest of others; their depth is 0
void move_with_camera(const PrimaryCamera& previous, double no_motion_px, uint32_t count, RayColumns& columns);

} // namespace packtrace
