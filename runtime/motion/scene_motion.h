#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "pbrt_import/scene/motion_pose.h"
#include "pbrt_import/scene/scene.h"
#include "runtime/motion/motion_targets.h"

namespace packtrace {

/// The rigid motion of a scene's instances and cameras over time in seconds. Before its first key and after its last
/// one, an instance or camera keeps the pose of that key, unless its track repeats.
class SceneMotion {
public:
  SceneMotion() = default; ///< nothing moves

  /// The motion that a file holds.
  static SceneMotion of(const BakedFile& file);

  /// The motion of an imported scene.
  /// @param scene after separate_motion(); its shapes that move must be placed as instances, as FloatSource does
  static SceneMotion of(const Scene& scene);

  /// Adds motion, for example of read_motion_keys(). Instances that move already get the added motion instead.
  /// @param targets of the file or scene that this motion is of
  /// Throws Error(kUsage) if an instance cannot move.
  void add(const RigidMotion& motion, const MotionTargets& targets);

  bool moves() const { return !motion_.empty(); }
  double begin_s() const { return span_.begin_s; } ///< of the first key; 0 if nothing moves
  double end_s() const { return span_.end_s; }     ///< of the last key; 0 if nothing moves

  /// Numbers in SceneSource::instances(), ascending.
  std::span<const uint32_t> moving_instances() const { return numbers_; }

  /// Places all moving instances at a time. Runs on several threads; the results do not depend on their number.
  /// @param world_from_object one per moving instance, relative to SceneSource::origin(); may be singular where a
  /// scale passes through zero
  void pose(double time_s, std::span<Affine> world_from_object) const;

  /// One instance at a time, in doubles.
  /// @param moving index into moving_instances()
  DAffine pose(size_t moving, double time_s) const;

  /// Stated error of the motion of one instance against the source, world units; 0 for floats.
  double error_world(size_t moving) const { return motion_.instances[moving].error_world; }

  bool camera_moves(uint32_t index) const;
  /// The camera of that number at a time; none if there is no such camera.
  std::optional<Camera> camera(uint32_t index, double time_s) const;

  /// Bounds of all moving instances at all times; conservative, relative to SceneSource::origin().
  const Bounds& moving_bounds() const { return bounds_; }

private:
  SceneMotion(RigidMotion motion, const MotionTargets& targets, std::vector<Camera> cameras);
  void prepare(const MotionTargets& targets);

  RigidMotion motion_;
  std::vector<uint32_t> numbers_;
  std::vector<Affine> placements_; ///< by moving instance, at rest
  std::vector<Camera> cameras_;    ///< all of the scene
  TimeSpan span_{0.0, 0.0};
  Bounds bounds_;
};

} // namespace packtrace
