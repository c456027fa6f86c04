#pragma once

#include <optional>

#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// Returns the placement of an instance whose surface is stored in unit space.
Placement direct_placement(uint32_t instance, const DAffine& world_from_object);

/// Returns the placement of an instance whose surface has its own coordinates, into which the tracer transforms
/// rays.
/// @param unit_from_surface must be invertible
Placement instanced_placement(uint32_t instance, const DAffine& world_from_object, const DAffine& unit_from_surface);

/// Does the same for tracers that transform rays in doubles and round them once, in the surface's coordinates: bounds
/// of moved coordinates are zero.
Placement exactly_instanced_placement(uint32_t instance, const DAffine& world_from_object,
                                      const DAffine& unit_from_surface);

/// Whether the inverse of a placement in floats is accurate enough for hits to lie on the surface.
/// @param unit_from_surface transform from coordinates of about unit size
bool traceable_as_instance(const DAffine& unit_from_surface);

/// Returns a transform that doubles can invert accurately enough for hits to lie on the surface: `to_from` itself if it
/// can be inverted. If it maps everything onto a plane, or nearly so, the result adds a thickness of 1e-8 of its
/// largest stretch, which floats cannot resolve. None if it maps everything onto a line or a point, or is not finite.
std::optional<DAffine> invertible_placement(const DAffine& to_from);

/// Returns a transform that is traceable_as_instance(): `unit_from_surface` itself if it is. If it maps everything onto
/// a plane, or nearly so, the result adds a thickness of 2^-15 of its largest stretch. None if it maps everything onto
/// a line or a point, nearly so, or to less than about 1e-12 of the unit space.
std::optional<DAffine> traceable_placement(const DAffine& unit_from_surface);

/// Returns the world bounds of a source's instances. Throws Error(kInput) for a transform that is not finite.
/// @param bounds object-space bounds, by geometry
Bounds placed_bounds(const SceneSource& source, std::span<const Bounds> bounds);

} // namespace packtrace
