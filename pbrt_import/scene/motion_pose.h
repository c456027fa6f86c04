#pragma once

#include <span>

#include "pbrt_import/scene/bounds.h"
#include "pbrt_import/scene/rigid_motion.h"

namespace packtrace {

/// Evaluates a track with at least one key. Linear tracks follow pbrt: translation and scale linear, rotation by
/// slerp. Catmull-Rom tracks use cubic Hermite curves whose tangent at a key is the difference of its neighbours over
/// the difference of their times, one-sided at the ends, around the end in loops; quaternions are interpolated so by
/// component and normalised.
/// Sources: Pharr, Jakob, Humphreys, Physically Based Rendering, 3rd ed. (2016), section 2.9.3; Catmull, Rom, A Class
/// of Local Interpolating Splines (1974).
DAffine pose(const MotionTrack& track, double time_s);

/// world_from_object of a moving instance. The result may be singular where a scale passes through zero.
/// @param placement world_from_object of the instance at rest; used by relative motion only
DAffine pose(const RigidMotion& motion, const InstanceMotion& instance, const Affine& placement, double time_s);

/// The same, from the poses of all tracks at a time.
/// @param tracks one per track of the motion
DAffine pose_from_tracks(const InstanceMotion& instance, const Affine& placement, std::span<const DAffine> tracks);

/// Bounds of a moving box at all times. Conservative, also for poses rounded to float.
Bounds swept_bounds(const RigidMotion& motion, const InstanceMotion& instance, const Affine& placement,
                    const Bounds& box);

/// Upper bound, at all times, of the factor by which an instance scales an error per object axis to an error per world
/// axis: the largest absolute row sum of world_from_object.
double largest_stretch(const RigidMotion& motion, const InstanceMotion& instance, const Affine& placement);

/// Bounds of the parts of a track at all times.
struct TrackExtent {
  Bounds translation;
  double scale_norm = 0.0;    ///< of the Frobenius norm of the scale
  double scale_row_sum = 0.0; ///< of the largest absolute row sum of rotation * scale
};
TrackExtent extent_of(const MotionTrack& track);

/// An interval of time. Empty (begin > end) if nothing moves.
struct TimeSpan {
  double begin_s = 0.0, end_s = -1.0;
};

/// The interval from the first to the last key of all tracks with at least two keys.
TimeSpan time_span(const RigidMotion& motion);

} // namespace packtrace
