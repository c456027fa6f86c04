#include "runtime/motion/motion_targets.h"

#include <utility>

#include "compress/format/cluster/position_grid.h"
#include "compress/format/deformation/deformation_view.h"
#include "compress/format/file/baked_file.h"

namespace packtrace {
namespace {

/// Merges two lists that ascend; of two motions of the same thing, the added one stays.
template <typename Motion, typename Number>
std::vector<Motion> merged(const std::vector<Motion>& old, std::vector<Motion> added, uint32_t first_track,
                           const Number& number) {
  for (Motion& one : added) {
    one.track += first_track;
    if constexpr (requires { one.inner_track; })
      if (one.inner_track != kNoTrack) one.inner_track += first_track;
  }
  std::vector<Motion> result;
  auto at = old.begin();
  for (const Motion& one : added) {
    for (; at != old.end() && number(*at) < number(one); ++at) result.push_back(*at);
    if (at != old.end() && number(*at) == number(one)) ++at;
    result.push_back(one);
  }
  result.insert(result.end(), at, old.end());
  return result;
}

/// Unused tracks would lengthen the time span.
void drop_unused_tracks(RigidMotion& motion) {
  std::vector<uint32_t> numbers(motion.tracks.size(), kNoTrack);
  std::vector<MotionTrack> kept;
  const auto keep = [&](uint32_t& track) {
    if (track == kNoTrack) return;
    if (numbers[track] == kNoTrack) {
      numbers[track] = static_cast<uint32_t>(kept.size());
      kept.push_back(std::move(motion.tracks[track]));
    }
    track = numbers[track];
  };
  for (InstanceMotion& one : motion.instances) keep(one.track), keep(one.inner_track);
  for (CameraMotion& one : motion.cameras) keep(one.track);
  motion.tracks = std::move(kept);
}

/// Object-space box of all frames of a geometry that deforms.
Bounds bounds_of_frames(const baked::GeometryRecord& geometry, const baked::DeformationRecord& frames) {
  const double step = PositionGrid{geometry.step_mantissa, geometry.step_exponent}.step();
  Bounds bounds;
  for (int axis = 0; axis < 3; ++axis) {
    const int64_t lo = frames.lo[static_cast<size_t>(axis)];
    bounds.lo[axis] = static_cast<double>(from_lattice(lo, step));
    bounds.hi[axis] = static_cast<double>(from_lattice(lo + frames.extent[static_cast<size_t>(axis)], step));
  }
  return bounds;
}

} // namespace

Vec3 default_pivot(const MotionTarget& target) {
  if (target.box.empty()) return target.placement[3];
  return Vec3(transform_bounds(DAffine(target.placement), target.box).centre());
}

MotionTargets motion_targets(const BakedFile& file) {
  MotionTargets targets;
  targets.origin = file.origin();
  for (uint32_t i = 0; i < file.instances().size(); ++i) {
    const baked::GeometryRecord& g = file.geometries()[file.instances()[i].geometry];
    targets.instances.push_back({std::string(file.text(g.name)), file.world_from_object(i), object_bounds(g),
                                 (g.flags & baked::kWorldSpace) != 0});
  }
  for (const baked::DeformationRecord& frames : deformation_records(file.sections().deformation))
    for (uint32_t i = 0; i < file.instances().size(); ++i)
      if (file.instances()[i].geometry == frames.geometry)
        targets.instances[i].box = bounds_of_frames(file.geometries()[frames.geometry], frames);
  return targets;
}

MotionTargets motion_targets(const Scene& scene) {
  std::vector<Bounds> meshes, objects;
  for (const Mesh& mesh : scene.meshes) meshes.push_back(bounds_of(mesh.positions));
  for (const Object& object : scene.objects) {
    objects.emplace_back();
    for (const Shape& shape : object.shapes)
      objects.back().extend(transform_bounds(shape.parent_from_mesh, meshes[shape.mesh]));
  }
  MotionTargets targets;
  targets.origin = scene.origin;
  for (const Shape& shape : scene.shapes)
    targets.instances.push_back(
        {scene.meshes[shape.mesh].name, Affine(shape.parent_from_mesh), meshes[shape.mesh], false});
  for (const Instance& instance : scene.instances)
    targets.instances.push_back(
        {scene.objects[instance.object].name, instance.world_from_object, objects[instance.object], false});
  return targets;
}

void add_motion(RigidMotion& motion, const RigidMotion& added) {
  const auto first = static_cast<uint32_t>(motion.tracks.size());
  motion.tracks.insert(motion.tracks.end(), added.tracks.begin(), added.tracks.end());
  motion.instances =
      merged(motion.instances, added.instances, first, [](const InstanceMotion& one) { return one.instance; });
  motion.cameras = merged(motion.cameras, added.cameras, first, [](const CameraMotion& one) { return one.camera; });
  drop_unused_tracks(motion);
}

} // namespace packtrace
