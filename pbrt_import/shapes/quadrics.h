#pragma once

#include "pbrt_import/base/memory_budget.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// pbrt-v3's quadrics with their parameters and defaults. Angles are in degrees; limits may be in either order.
struct SphereParameters {
  float radius = 1.0f;
  float z_min = -1.0f; ///< clamped to [-radius, radius]; likewise z_max
  float z_max = 1.0f;
  float phi_max = 360.0f; ///< clamped to at most 360; likewise in the other quadrics
};
struct CylinderParameters {
  float radius = 1.0f;
  float z_min = -1.0f;
  float z_max = 1.0f;
  float phi_max = 360.0f;
};
struct DiskParameters {
  float height = 0.0f;
  float radius = 1.0f;
  float inner_radius = 0.0f;
  float phi_max = 360.0f;
};
struct ConeParameters {
  float radius = 1.0f;
  float height = 1.0f;
  float phi_max = 360.0f;
};
struct ParaboloidParameters { ///< z = z_max (r / radius)^2
  float radius = 1.0f;
  float z_min = 0.0f;
  float z_max = 1.0f;
  float phi_max = 360.0f;
};
struct HyperboloidParameters { ///< the segment p1 p2 swept around the z axis
  Vec3 p1{0.0f, 0.0f, 0.0f};
  Vec3 p2{1.0f, 1.0f, 1.0f};
  float phi_max = 360.0f;
};

/// Tessellates quadrics with analytic unit normals and with uvs u = phi / phi_max and v as pbrt-v3 defines it for each
/// quadric. Vertex normals and geometric normals point along cross(dp/du, dp/dv). Vertices lie on the surface, rounded
/// to float. No point of a triangle is farther from the surface than relative_tolerance x radius, where the radius is
/// the largest distance of the quadric from its axis.
///
/// Full sweeps close exactly: the two columns of the seam, and the vertices of a pole, have bit-identical positions. So
/// do the rims of two quadrics that meet in a circle, given the same phi_max and tolerance. No triangle is degenerate.
/// For any parameters there are fewer than 2^23 vertices at the finest tolerance.
/// @param relative_tolerance within [1e-6, 0.5]
/// @param memory grows by the memory of the mesh, before it is allocated; null: not counted
/// Throws Error(kInput) if a parameter is not finite or leaves nothing to draw (radius <= 0, empty range, below float
/// precision); MemoryError.
/// Source: Matt Pharr, Wenzel Jakob and Greg Humphreys, Physically Based Rendering, 3rd edition, 2016, chapter 3.
Mesh tessellate_sphere(const SphereParameters& sphere, double relative_tolerance, MemoryReservation* memory = nullptr);
Mesh tessellate_cylinder(const CylinderParameters& cylinder, double relative_tolerance,
                         MemoryReservation* memory = nullptr);
Mesh tessellate_disk(const DiskParameters& disk, double relative_tolerance, MemoryReservation* memory = nullptr);
Mesh tessellate_cone(const ConeParameters& cone, double relative_tolerance, MemoryReservation* memory = nullptr);
Mesh tessellate_paraboloid(const ParaboloidParameters& paraboloid, double relative_tolerance,
                           MemoryReservation* memory = nullptr);
Mesh tessellate_hyperboloid(const HyperboloidParameters& hyperboloid, double relative_tolerance,
                            MemoryReservation* memory = nullptr);

} // namespace packtrace
