#pragma once

#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// How far a ray must start above a traced triangle so that it does not hit that triangle or its neighbours again.
/// The origin lies on the decoded surface, so quantisation does not count; only what float arithmetic loses does: in
/// the stored position, in moving the ray to unit space and into an instance, and in the tracer's plane test. Each loss
/// is at most a few ulp of the coordinates involved, but only the share along the normal lifts a ray off its plane:
///
///   offset = 4 eps (sum_i |n_i| m_i  +  d_surface)  +  eps max_i |p_i|,     eps = 2^-23 >= ulp(x) / x
///
/// m_i: largest coordinate on axis i among the point (in the world and in unit space) and the triangle's vertices;
/// d_surface, for instanced placements: the same sum in surface coordinates with m including |L| |p| + |t| of the
/// inverse placement (L, t) times |L| |L^-1| for its rounding, as a distance along the normal. The last term keeps rays
/// off axis-aligned planes through the origin, where the first is zero.
/// @param position in unit space
/// @param normal unit length, in unit space
/// @return in unit-space lengths
double ray_offset(const HitSurface& hit, const UnitSpace& space, DVec3 position, DVec3 normal);

} // namespace packtrace
