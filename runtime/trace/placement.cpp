#include "runtime/trace/placement.h"

#include <cmath>
#include <string>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

double norm(const glm::dmat3& m) {
  return std::sqrt(glm::dot(m[0], m[0]) + glm::dot(m[1], m[1]) + glm::dot(m[2], m[2]));
}

/// Whether the transform can be inverted in doubles accurately enough for hits to lie on the surface.
bool is_invertible(const DAffine& to_from) {
  constexpr double kMaxCondition = 1e9;
  const DAffine from_to = inverse(to_from);
  return norm(glm::dmat3(to_from)) * norm(glm::dmat3(from_to)) <= kMaxCondition &&
         is_finite(DVec3(from_to[3])); // false for NaN
}

/// Returns the unit vector perpendicular to two of three vectors; of the three pairs it takes the one with the largest
/// cross product. Zero if all three are parallel.
DVec3 perpendicular(DVec3 a, DVec3 b, DVec3 c) {
  DVec3 best(0.0);
  for (const DVec3 v : {glm::cross(a, b), glm::cross(b, c), glm::cross(c, a)})
    if (glm::dot(v, v) > glm::dot(best, best)) best = v;
  const double length = glm::length(best);
  return length > 0.0 ? best / length : best;
}

/// Stretches what lies along the direction that a transform flattens most, by a fraction of its largest stretch.
DAffine thickened(const DAffine& to_from, double thickness) {
  const glm::dmat3 linear(to_from), transposed = glm::transpose(linear);
  const double size = norm(linear);
  // Normalised, so that products of two neither overflow nor underflow.
  const glm::dmat3 columns = linear / size, rows = transposed / size;
  const DVec3 plane_normal = perpendicular(columns[0], columns[1], columns[2]);
  const DVec3 lost_direction = perpendicular(rows[0], rows[1], rows[2]);
  const double side = glm::dot(plane_normal, linear * lost_direction) < 0.0 ? -1.0 : 1.0;
  const glm::dmat3 thick = linear + glm::outerProduct(plane_normal * (side * thickness * size), lost_direction);
  return DAffine(thick[0], thick[1], thick[2], to_from[3]);
}

glm::dmat3 absolute(const glm::dmat3& m) { return {glm::abs(m[0]), glm::abs(m[1]), glm::abs(m[2])}; }

} // namespace

Placement direct_placement(uint32_t instance, const DAffine& world_from_object) {
  Placement placement;
  placement.instance = instance;
  placement.object_normal = normal_matrix(world_from_object);
  return placement;
}

Placement exactly_instanced_placement(uint32_t instance, const DAffine& world_from_object,
                                      const DAffine& unit_from_surface) {
  Placement placement = direct_placement(instance, world_from_object);
  placement.instanced = true;
  placement.unit_from_surface = unit_from_surface;
  placement.surface_normal = normal_matrix(unit_from_surface);
  return placement;
}

Placement instanced_placement(uint32_t instance, const DAffine& world_from_object, const DAffine& unit_from_surface) {
  Placement placement = exactly_instanced_placement(instance, world_from_object, unit_from_surface);
  const DAffine surface_from_unit = inverse(unit_from_surface);
  const glm::dmat3 inverted(surface_from_unit);
  const glm::dmat3 growth = absolute(inverted) * absolute(glm::dmat3(unit_from_surface));
  placement.moved_linear = growth * absolute(inverted);
  placement.moved_offset = growth * glm::abs(DVec3(surface_from_unit[3]));
  return placement;
}

bool traceable_as_instance(const DAffine& unit_from_surface) {
  constexpr double kMaxNorm = 1e12, kMaxCondition = 65536.0;
  const glm::dmat3 linear(unit_from_surface);
  const glm::dmat3 inverted = glm::inverse(linear);
  const double forward = norm(linear), backward = norm(inverted);
  return forward <= kMaxNorm && backward <= kMaxNorm && forward * backward <= kMaxCondition; // false for NaN
}

std::optional<DAffine> invertible_placement(const DAffine& to_from) {
  constexpr double kThickness = 1e-8;
  if (is_invertible(to_from)) return to_from;
  const DAffine result = thickened(to_from, kThickness);
  if (!is_invertible(result)) return std::nullopt;
  return result;
}

std::optional<DAffine> traceable_placement(const DAffine& unit_from_surface) {
  constexpr double kThickness = 0x1p-15;
  if (traceable_as_instance(unit_from_surface)) return unit_from_surface;
  const DAffine result = thickened(unit_from_surface, kThickness);
  if (!traceable_as_instance(result)) return std::nullopt;
  return result;
}

Bounds placed_bounds(const SceneSource& source, std::span<const Bounds> bounds) {
  Bounds world;
  uint32_t index = 0;
  for (const PlacedGeometry& placed : source.instances()) {
    const DAffine world_from_object(placed.world_from_object);
    if (!std::isfinite(norm(glm::dmat3(world_from_object))) || !is_finite(DVec3(world_from_object[3])))
      throw Error(ErrorKind::kInput, "the transform of instance " + std::to_string(index) + " is not finite");
    const Bounds box = transform_bounds(world_from_object, bounds[placed.geometry]);
    if (!box.empty()) world.extend(box);
    ++index;
  }
  return world;
}

} // namespace packtrace
