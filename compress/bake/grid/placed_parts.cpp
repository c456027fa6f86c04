#include "compress/bake/grid/placed_parts.h"

#include <algorithm>

#include "compress/bake/grid/picture_bounds.h"
#include "compress/bake/grid/scene_measure.h"

namespace packtrace {

PlacedParts::PlacedParts(const Scene& scene, const ScenePlan& plan, std::span<const uint32_t> instances,
                         std::span<const GeometryGrid> grids)
    : scene_(scene), grids_(grids) {
  for (const uint32_t i : instances) {
    const baked::InstanceRecord& instance = plan.instances[i];
    const GeometryPlan& geometry = plan.geometries[instance.geometry];
    for (const GeometryPart& part : geometry.parts) {
      const auto count = static_cast<uint32_t>(scene.meshes[part.mesh].triangles.size());
      if (count == 0 || (geometry.slot_class[part.slot] & 1u) != 0) continue; // bit 0: invisible to cameras
      parts_.push_back({instance.geometry, &part, placement_of(instance), triangles_, PartMap(part),
                        placement_of(instance) != DAffine(1.0),
                        grids[instance.geometry].coarsest_step() * world_scale(geometry)});
      triangles_ += count;
    }
  }
}

const PlacedPart& PlacedParts::part_of(uint32_t triangle) const {
  const auto after = std::upper_bound(parts_.begin(), parts_.end(), triangle,
                                      [](uint32_t n, const PlacedPart& part) { return n < part.first_triangle; });
  return *std::prev(after);
}

DVec3 PlacedParts::rounded_position(const PlacedPart& placed, uint32_t vertex) const {
  const GeometryGrid& grid = grids_[placed.geometry];
  const double step = grid.grid.step();
  const LatticePoint q = grid.round(placed.in_geometry(mesh_of(placed).positions[vertex]));
  return placed.in_world({from_lattice(q[0], step), from_lattice(q[1], step), from_lattice(q[2], step)});
}

std::array<DVec3, 3> PlacedParts::corners(uint32_t triangle, Position position) const {
  const PlacedPart& placed = part_of(triangle);
  const Triangle& t = mesh_of(placed).triangles[triangle - placed.first_triangle];
  return {(this->*position)(placed, t.x), (this->*position)(placed, t.y), (this->*position)(placed, t.z)};
}

} // namespace packtrace
