#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pbrt_import/language/parser.h"
#include "pbrt_import/scene/rigid_motion.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// The tracks of a scene that is being built, and the instances that follow them.
class TrackedMotions {
public:
  /// Returns the number of the track, for TrackedMotion.
  uint32_t add_track(MotionTrack track);
  /// @param instance index into Scene::instances, above those before
  void add_instance(uint32_t instance, const TrackedMotion& motion);
  /// After instances were dropped.
  /// @param numbers by old number: the new one, or kDropped; empty if none was dropped
  void renumber(std::span<const uint32_t> numbers);
  size_t instance_count() const { return instances_.size(); }

  /// Makes the scene's motion, with the tracks that something follows.
  /// @param shape_count of shapes outside objects, which have the numbers before instances
  /// @param camera_tracks by index into Scene::cameras; kNoTrack: it stands still
  RigidMotion take(size_t shape_count, std::span<const uint32_t> camera_tracks);

private:
  struct Instance {
    uint32_t instance = 0;
    TrackedMotion motion;
  };
  std::vector<MotionTrack> tracks_;
  std::vector<Instance> instances_;
};

} // namespace packtrace
