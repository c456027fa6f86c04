#include "runtime/denoise/depth_derivatives.h"

#include <cmath>

#include "runtime/denoise/simd.h"

namespace packtrace {
namespace {

/// Derivative at `centre` from three consecutive disparities, where 0 means a miss.
inline float smaller_difference(float before, float centre, float after) {
  const float backward = centre - before, forward = after - centre;
  const bool use_backward = before > 0.0f && !(after > 0.0f && std::abs(forward) < std::abs(backward));
  const float chosen = use_backward ? backward : after > 0.0f ? forward : 0.0f;
  return centre > 0.0f ? chosen : 0.0f;
}

} // namespace

PACKTRACE_AVX2_CLONES
void derive_row(int width, const float* above, const float* here, const float* below, float* dx, float* dy) {
#pragma GCC ivdep
  for (int i = 0; i < width; ++i) {
    dx[i] = smaller_difference(here[i - 1], here[i], here[i + 1]);
    dy[i] = smaller_difference(above[i], here[i], below[i]);
  }
}

} // namespace packtrace
