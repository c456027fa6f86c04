#include "compress/format/motion/rigid_motion_validation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "compress/format/motion/motion_stream.h"
#include "pbrt_import/scene/motion_pose.h"

namespace packtrace {
namespace {

/// Bounds of what a track does to points; coordinates of maps and points in sums of absolute values.
struct TrackBounds {
  double translation, scale;
};

double largest_coordinate(const baked::GeometryRecord& g) {
  double largest = 0.0;
  for (size_t axis = 0; g.cluster_count > 0 && axis < 3; ++axis)
    largest = std::max({largest, std::abs(double{g.bounds_lo[axis]}), std::abs(double{g.bounds_hi[axis]})});
  return largest;
}

/// Whether floats can hold all poses of the instance and its points. The check is coarse, but takes the same time for
/// any number of keys.
bool within_range(const InstanceMotion& moving, const std::vector<TrackBounds>& bounds,
                  const baked::InstanceRecord& record, double coordinate) {
  constexpr double kSafety = 16.0; // sums over axes, and lengths of box corners
  double translation = 0.0, scale = 1.0;
  if (moving.relative) {
    for (size_t i = 0; i < 9; ++i) scale = std::max(scale, std::abs(double{record.world_from_object[i]}));
    for (size_t i = 9; i < 12; ++i) translation = std::max(translation, std::abs(double{record.world_from_object[i]}));
    for (int axis = 0; axis < 3; ++axis) translation += std::abs(double{moving.pivot[axis]});
  } else if (moving.inner_track != kNoTrack) {
    translation = bounds[moving.inner_track].translation, scale = std::max(1.0, bounds[moving.inner_track].scale);
  }
  const TrackBounds& outer = bounds[moving.track];
  translation = outer.translation + translation * std::max(1.0, outer.scale);
  scale *= std::max(1.0, outer.scale);
  return kSafety * (translation + scale * std::max(1.0, coordinate)) <= std::numeric_limits<float>::max();
}

} // namespace

std::optional<MotionFault> validate_rigid_motion(const BakedSections& sections) {
  RigidMotion motion;
  if (const auto fault = unpack_rigid_motion(sections.rigid_motion, motion)) return fault;
  std::vector<TrackBounds> bounds;
  for (const MotionTrack& track : motion.tracks) {
    const TrackExtent extent = extent_of(track);
    const DVec3 far = glm::max(glm::abs(extent.translation.lo), glm::abs(extent.translation.hi));
    bounds.push_back({far.x + far.y + far.z, extent.scale_norm});
  }
  uint64_t part = motion.tracks.size();
  for (const InstanceMotion& moving : motion.instances) {
    if (moving.instance >= sections.instances.size()) return MotionFault{part, "instance"};
    const baked::InstanceRecord& record = sections.instances[moving.instance];
    const baked::GeometryRecord& geometry = sections.geometries[record.geometry];
    if ((geometry.flags & baked::kWorldSpace) != 0) return MotionFault{part, "instance is in world space"};
    if (!within_range(moving, bounds, record, largest_coordinate(geometry)))
      return MotionFault{part, "motion out of range"};
    ++part;
  }
  for (const CameraMotion& moving : motion.cameras) {
    if (moving.camera >= sections.cameras.size()) return MotionFault{part, "camera"};
    ++part;
  }
  return std::nullopt;
}

} // namespace packtrace
