#pragma once

#include "runtime/denoise/plane.h"

namespace packtrace {

/// Accumulated history per pixel. All values are 0 where there is none.
struct History {
  Plane<float> mean;      ///< mean AO of the slow history
  Plane<float> samples;   ///< length of the slow history in frames (tspp); fractional after a correction or resampling
  Plane<uint16_t> square; ///< mean squared AO of the slow history, in units of 1 / kMomentUnits
  Plane<uint16_t> fast;   ///< fast history: mean AO of the last few frames, in the same units

  void resize(ImageSize size) { mean.resize(size), samples.resize(size), square.resize(size), fast.resize(size); }
  /// Plane::make_room() of all planes.
  void make_room(ImageSize size) {
    mean.make_room(size), samples.make_room(size), square.make_room(size), fast.make_room(size);
  }
  size_t bytes() const { return mean.bytes() + samples.bytes() + square.bytes() + fast.bytes(); }
};

} // namespace packtrace
