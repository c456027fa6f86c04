// Instances of EmbreeTracer that move.

#include "runtime/trace/embree/embree_parts.h"
#include "runtime/trace/placement.h"

namespace packtrace {

DAffine EmbreeTracer::unit_from_own(const UnitSpace& own, const Affine& world_from_object) const {
  return compose(compose(space_.unit_from_outer(), DAffine(world_from_object)), own.outer_from_unit());
}

void EmbreeTracer::place_instances(std::span<const uint32_t> instances, std::span<const Affine> world_from_object) {
  check_moves(movable_, instances, world_from_object);
  if (instances.empty()) return;
  for (size_t m = 0; m < instances.size(); ++m) {
    const uint32_t placement = placement_of_[instances[m]];
    if (placement == kNoHit) continue;
    const Surface& surface = surfaces_[surface_of_placement_[placement]];
    if (!within_traced_space(unit_from_own(surface.own, world_from_object[m]), surface.bounds.lo, surface.bounds.hi))
      throw_out_of_space(instances[m]);
  }
  for (size_t m = 0; m < instances.size(); ++m) {
    world_from_object_[instances[m]] = world_from_object[m];
    update_mover(instances[m], DAffine(world_from_object[m]));
  }
  list_flat_instances();
  rtcCommitScene(device_->top.get());
  device_->embree.check();
}

/// Brings a mover's placement and its geometry in the top scene up to date with its transform.
void EmbreeTracer::update_mover(uint32_t instance, const DAffine& world_from_object) {
  const uint32_t number = placement_of_[instance];
  if (number == kNoHit) return;
  const Surface& surface = surfaces_[surface_of_placement_[number]];
  const std::optional<DAffine> unit_from_surface =
      traceable_placement(unit_from_own(surface.own, Affine(world_from_object)));
  hidden_[number] = unit_from_surface ? 0 : 1;
  const uint32_t id = attachment_of_[number];
  if (unit_from_surface) placements_[number] = instanced_placement(instance, world_from_object, *unit_from_surface);
  if (id == kNoHit) return; // all of its triangles are invisible
  const RTCGeometry geometry = rtcGetGeometry(device_->top.get(), id);
  if (!unit_from_surface) {
    rtcDisableGeometry(geometry);
  } else {
    const Affine transform(*unit_from_surface);
    rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, &transform[0][0]);
    rtcEnableGeometry(geometry);
  }
  rtcCommitGeometry(geometry);
}

void EmbreeTracer::list_flat_instances() {
  flat_instances_.clear();
  for (uint32_t i = 0; i < placement_of_.size(); ++i)
    if (placement_of_[i] != kNoHit && hidden_[placement_of_[i]] != 0) flat_instances_.push_back(i);
}

std::array<DVec3, 3> EmbreeTracer::object_vertices(const RayHit& hit, const HitSurface& surface) const {
  const Placement& placement = *surface.placement;
  const DAffine object_from_surface =
      placement.instanced ? surfaces_[surface_of_placement_[hit.placement]].own.outer_from_unit()
                          : inverse(compose(space_.unit_from_outer(),
                                            DAffine(source_.instances()[placement.instance].world_from_object)));
  std::array<DVec3, 3> vertices;
  for (size_t i = 0; i < 3; ++i) vertices[i] = transform_point(object_from_surface, DVec3(surface.vertices[i]));
  return vertices;
}

} // namespace packtrace
