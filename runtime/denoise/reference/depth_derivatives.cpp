#include "runtime/denoise/reference/depth_derivatives.h"

#include <cmath>

#include "runtime/denoise/simd.h"

namespace packtrace::reference {
namespace {

/// Derivative at `centre` from three consecutive depths, where 0 means a miss.
inline float smaller_depth_difference(float before, float centre, float after) {
  const float backward = centre - before, forward = after - centre;
  const bool has_before = before > 0.0f, has_after = after > 0.0f;
  const bool use_forward = has_after & (!has_before | (std::abs(forward) < std::abs(backward)));
  const float chosen = use_forward ? forward : has_before ? backward : 0.0f;
  return centre > 0.0f ? chosen : 0.0f;
}

PACKTRACE_AVX2_CLONES
void derive_depth_row(int width, const float* above, const float* here, const float* below, float* __restrict dx,
                      float* __restrict dy) {
  for (int x = 0; x < width; ++x) {
    dx[x] = smaller_depth_difference(here[x - 1], here[x], here[x + 1]);
    dy[x] = smaller_depth_difference(above[x], here[x], below[x]);
  }
}

} // namespace

void derive_depth(const Surfaces& surfaces, Derivatives& derivatives) {
  const Plane<float>& z = surfaces.z;
  for_row_blocks(surfaces.size.height, [&](int first, int last) {
    for (int y = first; y < last; ++y)
      derive_depth_row(static_cast<int>(surfaces.size.width), z.row(y - 1), z.row(y), z.row(y + 1),
                       derivatives.x.row(y), derivatives.y.row(y));
  });
}

} // namespace packtrace::reference
