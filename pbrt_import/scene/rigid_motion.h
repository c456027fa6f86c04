#pragma once

#include <cstdint>
#include <vector>

#include <glm/gtc/quaternion.hpp>

#include "pbrt_import/scene/math.h"

namespace packtrace {

enum class KeyInterpolation : uint32_t {
  kLinear = 0,    ///< translation and scale linear, rotation spherical (slerp), as in pbrt
  kCatmullRom = 1 ///< cubic through all keys; rotation by slerps with the tangents of its neighbours
};

/// A transform at a time: translation * rotation * scale.
struct MotionKey {
  double time_s = 0.0;
  DVec3 translation{0.0};
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0}; ///< unit length; its sign selects the arc to its neighbours
  glm::dmat3 scale{1.0};                   ///< symmetric
};

/// A transform over time, constant before the first key and after the last one, or repeated.
struct MotionTrack {
  KeyInterpolation interpolation = KeyInterpolation::kLinear;
  bool loop = false; ///< repeats with the period last time - first time
  std::vector<MotionKey> keys; ///< at least one; times ascend strictly; a single key is a constant
};

inline constexpr uint32_t kNoTrack = ~0u;

/// Motion of an instance over time t:
///   absolute  world_from_object(t) = track(t) inner_track(t), without the second factor if there is none
///   relative  world_from_object(t) = T(pivot) track(t) T(-pivot) placement, where T translates
struct InstanceMotion {
  uint32_t instance = 0; ///< number in SceneSource::instances(): shapes outside objects first, then object instances
  uint32_t track = 0;    ///< index into RigidMotion::tracks
  uint32_t inner_track = kNoTrack; ///< absolute motion only: a track that moves within its parent
  bool relative = false;
  Vec3 pivot{0.0f}; ///< relative motion only; world coordinates minus Scene::origin
  /// Bound of the distance between a point of the instance's box and where the unpacked motion puts it, at any time.
  /// World units; 0: not packed.
  double error_world = 0.0;
};

/// Motion of a camera: world_from_camera(t) = track(t).
struct CameraMotion {
  uint32_t camera = 0; ///< index into Scene::cameras
  uint32_t track = 0;
  double error_world = 0.0; ///< as above, for the box from -1 to 1 in camera space
};

/// Motion of a scene. Instances and cameras that are not listed do not move.
struct RigidMotion {
  std::vector<MotionTrack> tracks;
  std::vector<InstanceMotion> instances; ///< ascending by instance, each once
  std::vector<CameraMotion> cameras;     ///< ascending by camera, each once

  bool empty() const { return instances.empty() && cameras.empty(); }
};

} // namespace packtrace
