#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pbrt_import/scene/bounds.h"
#include "runtime/trace/source/scene_source.h"

namespace packtrace {

/// The instances that may move after a tracer is made.
struct Movers {
  std::vector<uint32_t> instances; ///< indices into SceneSource::instances(), strictly ascending
  /// World-space bounds of these instances at all times. The tracer chooses its space() for them and for the instances
  /// as they are placed when it is made, so that the space stays the same while they move.
  Bounds world;
};

/// Returns one byte per instance: 1 if it may move. Throws Error(kUsage) for numbers that do not ascend or do not
/// exist, and for bounds that are not finite.
/// @param count number of instances
std::vector<uint8_t> movable_instances(const Movers& movers, size_t count);

/// Checks the arguments of RayTracer::place_instances().
/// @param movable one byte per instance, as above; empty: nothing may move
/// Throws Error(kUsage) for spans of different sizes, numbers that do not ascend, and instances that may not move,
/// Error(kInput) for transforms that are not finite.
void check_moves(std::span<const uint8_t> movable, std::span<const uint32_t> instances,
                 std::span<const Affine> world_from_object);

/// Whether a placed box lies where a tracer can trace it: not farther from the origin of unit space, on any axis, than
/// twice UnitSpace::kHalfSize, so that camera rays from any distance reach it.
/// @param lo, hi the box in the surface's coordinates
bool within_traced_space(const DAffine& unit_from_surface, DVec3 lo, DVec3 hi);

/// Throws an Error(kUsage) for an instance that would leave Movers::world too far.
[[noreturn]] void throw_out_of_space(uint32_t instance);

/// Returns the bounds of a source's instances and of all places of those that may move. Throws like placed_bounds().
/// @param bounds object-space bounds, by geometry
Bounds bounds_of_motion(const SceneSource& source, std::span<const Bounds> bounds, const Movers& movers);

} // namespace packtrace
