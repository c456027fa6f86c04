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

PACKTRACE_AVX2_CLONES
void derive_row(int width, const float* above, const float* here, const float* below, float* __restrict dx,
                float* __restrict dy) {
  for (int i = 0; i < width; ++i) {
    dx[i] = smaller_difference(here[i - 1], here[i], here[i + 1]);
    dy[i] = smaller_difference(above[i], here[i], below[i]);
  }
}

} // namespace

void DepthDerivatives::compute(const Guides& guides) {
  for_row_blocks(guides.size.height, [&](int first, int last) {
    for (int row = first; row < last; ++row)
      derive_row(static_cast<int>(guides.size.width), guides.disparity.row(row - 1), guides.disparity.row(row),
                 guides.disparity.row(row + 1), x.row(row), y.row(row));
  });
}

} // namespace packtrace
