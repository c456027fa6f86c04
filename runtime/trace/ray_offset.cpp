#include "runtime/trace/ray_offset.h"

#include <algorithm>

namespace packtrace {
namespace {

constexpr double kEpsilon = 0x1p-23;
constexpr double kUlps = 4.0;

DVec3 largest_vertex(const HitSurface& hit) {
  return glm::max(glm::max(glm::abs(DVec3(hit.vertices[0])), glm::abs(DVec3(hit.vertices[1]))),
                  glm::abs(DVec3(hit.vertices[2])));
}

} // namespace

double ray_offset(const HitSurface& hit, const UnitSpace& space, DVec3 position, DVec3 normal) {
  const DVec3 in_world = glm::abs(space.from_unit(position)) * space.scale();
  DVec3 magnitude = glm::max(glm::abs(position), in_world);
  double distance = 0.0;
  if (!hit.placement->instanced) {
    magnitude = glm::max(magnitude, largest_vertex(hit));
  } else {
    const Placement& placement = *hit.placement;
    const DVec3 moved = placement.moved_linear * glm::abs(position) + placement.moved_offset;
    const DVec3 in_surface = glm::max(moved, largest_vertex(hit));
    // An error e in surface coordinates is L e in unit space, and n . L e along the normal. In GLM, normal * L is L^T
    // n.
    distance = glm::dot(glm::abs(normal * glm::dmat3(placement.unit_from_surface)), in_surface);
  }
  distance += glm::dot(glm::abs(normal), magnitude);
  return kEpsilon * (kUlps * distance + std::max({in_world.x, in_world.y, in_world.z}));
}

} // namespace packtrace
