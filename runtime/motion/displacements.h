#pragma once

#include <span>
#include <string>

#include "runtime/motion/motion_targets.h"

namespace packtrace {

/// An instance that stands elsewhere than at rest.
struct Displacement {
  uint32_t instance = 0;
  DVec3 world{0.0}; ///< world units from where it is at rest
};

/// The motion of displaced instances: the result of read_motion_keys() for displacement_keys().
/// @param displacements ascending by instance
RigidMotion displacement_motion(std::span<const Displacement> displacements, const MotionTargets& targets);

/// A file of keys (docs/motion.md) with one key per displaced instance.
/// @param displacements ascending by instance
std::string displacement_keys(std::span<const Displacement> displacements, const MotionTargets& targets);

} // namespace packtrace
