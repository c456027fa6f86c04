#pragma once

#include <cmath>

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

/// Returns the absolute values of components, without a comparison.
inline DVec3 magnitudes(DVec3 v) { return {std::abs(v.x), std::abs(v.y), std::abs(v.z)}; }

/// d_surface of a hit on an instanced placement, in unit-space lengths; inline, so that loops over hits can be
/// vectorised.
/// @param largest absolute coordinates of the triangle's vertices and of the moved point, whichever are larger
/// @param linear linear part of Placement::unit_from_surface
inline double surface_offset(DVec3 largest, const glm::dmat3& linear, DVec3 normal) {
  // An error e in surface coordinates is L e in unit space, and n . L e along the normal. In GLM, normal * L is L^T n.
  return glm::dot(magnitudes(normal * linear), largest);
}

/// The offset from its parts; inline, so that loops over hits can be vectorised.
/// @param vertices largest absolute coordinates of the triangle's vertices; 0 for instanced placements
/// @param surface surface_offset(); 0 for other placements
inline double ray_offset(DVec3 vertices, double surface, const UnitSpace& space, DVec3 position, DVec3 normal) {
  constexpr double kEpsilon = 0x1p-23, kUlps = 4.0;
  const DVec3 in_world = magnitudes(space.from_unit(position)) * space.scale();
  const DVec3 magnitude = glm::max(glm::max(magnitudes(position), in_world), vertices);
  const double distance = surface + glm::dot(magnitudes(normal), magnitude);
  return kEpsilon * (kUlps * distance + glm::max(glm::max(in_world.x, in_world.y), in_world.z));
}

} // namespace packtrace
