#pragma once

#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// Returns how far above a traced triangle a ray must start so that it does not hit that triangle or its neighbours
/// again, in unit-space lengths. The origin lies on the decoded surface, so quantisation does not matter. What matters
/// are the rounding errors of float arithmetic: of the stored position, of the transforms of the ray to unit space and
/// into an instance, and of the tracer's plane test. Each error is at most a few ulp of the coordinates involved, but
/// only its component along the normal lifts a ray off its plane:
///
///   offset = 4 eps (sum_i |n_i| m_i  +  d_surface)  +  eps max_i |p_i|,     eps = 2^-23 >= ulp(x) / x
///
/// m_i is the largest coordinate on axis i of the point (in the world and in unit space) and of the triangle's
/// vertices. d_surface, for instanced placements, is the same sum in surface coordinates, as a distance along the
/// normal; its m also includes |L| |p| + |t| of the inverse placement (L, t), times |L| |L^-1| for the rounding of the
/// inverse. The last term keeps rays off axis-aligned planes through the origin, for which the first term is zero.
/// @param position in unit space
/// @param normal unit length, in unit space
double ray_offset(const HitSurface& hit, const UnitSpace& space, DVec3 position, DVec3 normal);

/// d_surface of a hit on an instanced placement, in unit-space lengths.
double surface_offset(const HitSurface& hit, DVec3 position, DVec3 normal);

/// The offset from its parts; inline, so that loops over hits can be vectorised.
/// @param vertices largest absolute coordinates of the triangle's vertices; 0 for instanced placements
/// @param surface surface_offset(); 0 for other placements
inline double ray_offset(DVec3 vertices, double surface, const UnitSpace& space, DVec3 position, DVec3 normal) {
  constexpr double kEpsilon = 0x1p-23, kUlps = 4.0;
  const DVec3 in_world = glm::abs(space.from_unit(position)) * space.scale();
  const DVec3 magnitude = glm::max(glm::max(glm::abs(position), in_world), vertices);
  const double distance = surface + glm::dot(glm::abs(normal), magnitude);
  return kEpsilon * (kUlps * distance + glm::max(glm::max(in_world.x, in_world.y), in_world.z));
}

} // namespace packtrace
