#pragma once

#include "runtime/denoise/plane.h"

namespace packtrace {

/// What is remembered of every pixel. All 0 where there is no history.
struct History {
  Plane<float> mean;    ///< mean AO of the slow history
  Plane<float> square;  ///< mean of squared AO over the same frames
  Plane<float> fast;    ///< mean AO of the last few frames
  Plane<float> samples; ///< frames that `mean` stands for (tspp); not whole after a correction or resampling

  void resize(ImageSize size) { mean.resize(size), square.resize(size), fast.resize(size), samples.resize(size); }
};

} // namespace packtrace
