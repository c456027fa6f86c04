#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "compress/format/motion/motion_fault.h"
#include "pbrt_import/scene/rigid_motion.h"

namespace packtrace {

/// Steps by which the keys of a track are rounded (docs/baked_format.md).
struct TrackSteps {
  int translation_exponent = 0; ///< steps of 2^exponent
  int scale_exponent = 0;
  uint32_t rotation_bits = kMaxRotationBits; ///< per component of a quaternion, 2..kMaxRotationBits

  static constexpr uint32_t kMaxRotationBits = 30;
};

/// Packs a track. Times are exact; parts that are the same in all keys are exact up to 2^-40 of their size.
std::vector<uint8_t> pack_track(const MotionTrack& track, const TrackSteps& steps);

/// Decodes a track that pack_track() made.
MotionTrack unpack_track(std::span<const uint8_t> bytes);

/// Assembles the section. error_world of instances and cameras is rounded up to 8 significant bits.
/// @param tracks by index in RigidMotion::tracks: what pack_track() made of it
std::vector<uint8_t> pack_rigid_motion(const RigidMotion& motion, std::span<const std::vector<uint8_t>> tracks);

/// Decodes the section. Empty bytes are no motion.
/// @param motion receives the result; valid if there is no fault
/// @return the fault of damaged bytes: tracks, instances and cameras are counted through
std::optional<MotionFault> unpack_rigid_motion(std::span<const uint8_t> bytes, RigidMotion& motion);

} // namespace packtrace
