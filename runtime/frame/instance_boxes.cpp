#include "runtime/frame/instance_boxes.h"

#include <utility>

#include "compress/format/deformation/deformation_view.h"
#include "runtime/trace/packed/scene/packed_tracer.h"

namespace packtrace {

InstanceBoxes::InstanceBoxes(const FrameScene& scene) : at_rest_(scene.source->geometry_count()) {
  if (scene.file == nullptr) return;
  for (size_t g = 0; g < at_rest_.size(); ++g) at_rest_[g] = object_bounds(scene.file->geometries()[g]);
  if (!scene.deforms) return;
  deforms_.assign(at_rest_.size(), 0);
  for (const baked::DeformationRecord& record : deformation_records(scene.file->sections().deformation))
    deforms_[record.geometry] = 1;
}

Bounds InstanceBoxes::bounds_of(const SceneSource& source, uint32_t geometry, const PackedTracer* tracer) {
  if (tracer != nullptr && !deforms_.empty() && deforms_[geometry] != 0) return tracer->current_bounds(geometry);
  std::optional<Bounds>& known = at_rest_[geometry];
  if (!known) {
    const GeometryCounts counts = source.counts(geometry);
    std::vector<Vec3> positions(counts.vertices);
    std::vector<Triangle> triangles(counts.triangles);
    source.decode(geometry, positions, triangles);
    known = packtrace::bounds_of(positions);
  }
  return *known;
}

void InstanceBoxes::find_places(const SceneSource& source, std::span<const uint32_t> moving,
                                std::span<const Affine> pose, const PackedTracer* tracer) {
  const std::span<const PlacedGeometry> instances = source.instances();
  now_.clear();
  const auto add = [&](uint32_t i, const Affine& world_from_object) {
    const uint32_t geometry = instances[i].geometry;
    now_.push_back({i, geometry, bounds_of(source, geometry, tracer), world_from_object});
  };
  if (tracer == nullptr || deforms_.empty()) {
    for (size_t m = 0; m < moving.size(); ++m) add(moving[m], pose[m]);
    return;
  }
  for (uint32_t i = 0, m = 0; i < instances.size(); ++i)
    if (m < moving.size() && moving[m] == i)
      add(i, pose[m++]);
    else if (deforms_[instances[i].geometry] != 0)
      add(i, instances[i].world_from_object);
}

void InstanceBoxes::follow(const SceneSource& source, std::span<const uint32_t> moving, std::span<const Affine> pose,
                           const PackedTracer* tracer) {
  std::swap(now_, before_);
  find_places(source, moving, pose, tracer);
  moved_.clear();
  if (!std::exchange(started_, true)) return;
  for (size_t a = 0, b = 0; b < now_.size(); ++b) {
    while (a < before_.size() && before_[a].instance < now_[b].instance) ++a;
    if (a == before_.size() || before_[a].instance != now_[b].instance) continue;
    const Place &last = before_[a], &now = now_[b];
    if (last.world_from_object == now.world_from_object && last.object.lo == now.object.lo &&
        last.object.hi == now.object.hi)
      continue;
    moved_.push_back(moved_box(now.instance, last.object, DAffine(last.world_from_object), now.object,
                               DAffine(now.world_from_object)));
  }
}

} // namespace packtrace
