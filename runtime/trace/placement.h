#pragma once

#include <optional>

#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// An instance whose surface already lies in unit space.
Placement direct_placement(uint32_t instance, const DAffine& world_from_object);

/// An instance whose surface has coordinates of its own, into which the tracer moves rays.
/// @param unit_from_surface invertible
Placement instanced_placement(uint32_t instance, const DAffine& world_from_object, const DAffine& unit_from_surface);

/// Whether the float inverse of a placement leaves enough digits to hit surfaces where they are.
/// @param unit_from_surface from coordinates of about unit size
bool traceable_as_instance(const DAffine& unit_from_surface);

/// The transform itself where doubles can invert it well enough that rays meet its surfaces where they are. Where it
/// presses all onto a plane, or nearly so, one that keeps a thickness of 1e-8 of its largest stretch, less than floats
/// tell apart, can. None where it presses all onto a line or a point, or is not finite.
std::optional<DAffine> invertible_placement(const DAffine& to_from);

/// The world box of a source's instances. Throws Error(kInput) for a transform that is not finite.
/// @param bounds of the geometries, object space
Bounds placed_bounds(const SceneSource& source, std::span<const Bounds> bounds);

} // namespace packtrace
