#include "runtime/trace/ray_offset.h"

namespace packtrace {
namespace {

DVec3 largest_vertex(const HitSurface& hit) {
  return glm::max(glm::max(magnitudes(DVec3(hit.vertices[0])), magnitudes(DVec3(hit.vertices[1]))),
                  magnitudes(DVec3(hit.vertices[2])));
}

} // namespace

double ray_offset(const HitSurface& hit, const UnitSpace& space, DVec3 position, DVec3 normal) {
  if (const Placement& placement = *hit.placement; placement.instanced) {
    const DVec3 moved = placement.moved_linear * magnitudes(position) + placement.moved_offset;
    const DVec3 largest = glm::max(moved, largest_vertex(hit));
    const double in_surface = surface_offset(largest, glm::dmat3(placement.unit_from_surface), normal);
    return ray_offset(DVec3(0.0), in_surface, space, position, normal);
  }
  return ray_offset(largest_vertex(hit), 0.0, space, position, normal);
}

} // namespace packtrace
