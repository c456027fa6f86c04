#include "runtime/trace/ray_offset.h"

namespace packtrace {
namespace {

DVec3 largest_vertex(const HitSurface& hit) {
  return glm::max(glm::max(glm::abs(DVec3(hit.vertices[0])), glm::abs(DVec3(hit.vertices[1]))),
                  glm::abs(DVec3(hit.vertices[2])));
}

} // namespace

double surface_offset(const HitSurface& hit, DVec3 position, DVec3 normal) {
  const Placement& placement = *hit.placement;
  const DVec3 moved = placement.moved_linear * glm::abs(position) + placement.moved_offset;
  const DVec3 in_surface = glm::max(moved, largest_vertex(hit));
  // An error e in surface coordinates is L e in unit space, and n . L e along the normal. In GLM, normal * L is L^T n.
  return glm::dot(glm::abs(normal * glm::dmat3(placement.unit_from_surface)), in_surface);
}

double ray_offset(const HitSurface& hit, const UnitSpace& space, DVec3 position, DVec3 normal) {
  if (hit.placement->instanced)
    return ray_offset(DVec3(0.0), surface_offset(hit, position, normal), space, position, normal);
  return ray_offset(largest_vertex(hit), 0.0, space, position, normal);
}

} // namespace packtrace
