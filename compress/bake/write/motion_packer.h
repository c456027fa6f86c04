#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pbrt_import/base/progress.h"
#include "pbrt_import/scene/bounds.h"
#include "pbrt_import/scene/rigid_motion.h"

namespace packtrace {

/// What moves with an instance.
struct MovingBox {
  Affine placement{1.0f};      ///< world_from_object at rest
  Bounds box;                  ///< of its geometry in object space; empty: nothing to see
  double position_error = 0.0; ///< bound per axis, object units
};

struct PackedMotion {
  std::vector<uint8_t> bytes; ///< the section; empty if nothing moves
  RigidMotion motion;         ///< what the bytes decode to
};

/// Largest error of a packed motion as a fraction of the geometry's position error, both in world units.
inline constexpr double kMotionErrorFraction = 1.0 / 8.0;

/// Rounds and packs the keys of moving instances and cameras. Steps are the largest for which the error, measured at
/// the corners of the instances' boxes at all keys and seven times between, is at most kMotionErrorFraction of the
/// position error. The stated error is 5/4 of the measured one, for times between. Equal tracks are stored once.
/// @param boxes one per moving instance
/// Throws Error(kCancelled).
PackedMotion pack_motion(const RigidMotion& source, std::span<const MovingBox> boxes, Progress& progress);

} // namespace packtrace
