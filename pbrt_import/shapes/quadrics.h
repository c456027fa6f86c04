#pragma once

#include "pbrt_import/base/memory_budget.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// pbrt-v3's quadrics with its parameters and defaults. Angles are in degrees; limits may come in either order.
struct SphereParameters {
  float radius = 1.0f;
  float z_min = -1.0f; ///< clamped to [-radius, radius], as z_max
  float z_max = 1.0f;
  float phi_max = 360.0f; ///< clamped to [0, 360], as all phi_max
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

/// Tessellations with analytic unit normals, uvs u = phi / phi_max and v as pbrt-v3 defines it for each quadric, and
/// both kinds of normal along cross(dp/du, dp/dv). Vertices lie on the surface (rounded to float); no point of a
/// triangle is farther from the surface than relative_tolerance x radius, the radius being the largest distance of the
/// quadric from its axis. Full sweeps close exactly: the seam's two columns, and the vertices of a pole, have
/// bit-identical positions. So have the rims of two quadrics that meet in one circle, given the same phi_max and
/// tolerance. No triangle is degenerate. There are less than 2^23 vertices at the finest tolerance, whatever the
/// parameters.
/// @param relative_tolerance within [1e-6, 0.5]
/// Throws Error(kInput) if a parameter is not finite or leaves nothing to draw (radius <= 0, empty range, thinner than
/// floats can tell).
/// Source: Matt Pharr, Wenzel Jakob and Greg Humphreys, Physically Based Rendering, 3rd edition, 2016, chapter 3.
Mesh tessellate_sphere(const SphereParameters& sphere, double relative_tolerance, MemoryReservation* memory = nullptr);
Mesh tessellate_cylinder(const CylinderParameters& cylinder, double relative_tolerance, MemoryReservation* memory = nullptr);
Mesh tessellate_disk(const DiskParameters& disk, double relative_tolerance, MemoryReservation* memory = nullptr);
Mesh tessellate_cone(const ConeParameters& cone, double relative_tolerance, MemoryReservation* memory = nullptr);
Mesh tessellate_paraboloid(const ParaboloidParameters& paraboloid, double relative_tolerance, MemoryReservation* memory = nullptr);
Mesh tessellate_hyperboloid(const HyperboloidParameters& hyperboloid, double relative_tolerance, MemoryReservation* memory = nullptr);

} // namespace packtrace
