#pragma once

#include "runtime/denoise/plane.h"

namespace packtrace {

/// Accumulated history per pixel. All values are 0 where there is none.
struct History {
  Plane<float> mean;     ///< mean AO of the slow history
  Plane<float> square;   ///< mean squared AO of the slow history
  Plane<float> fast;     ///< fast history: mean AO of the last few frames
  Plane<float> samples;  ///< length of the slow history in frames (tspp); fractional after a correction or resampling
  Plane<uint32_t> trend; ///< how fast the mean of stratified samples converges: trend.h

  void resize(ImageSize size) {
    mean.resize(size), square.resize(size), fast.resize(size), samples.resize(size), trend.resize(size);
  }
  size_t bytes() const { return mean.bytes() + square.bytes() + fast.bytes() + samples.bytes() + trend.bytes(); }
};

} // namespace packtrace
