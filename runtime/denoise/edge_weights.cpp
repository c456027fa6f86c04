#include "runtime/denoise/edge_weights.h"

#include <bit>
#include <cmath>

#include "runtime/denoise/simd.h"

namespace packtrace {
namespace {

/// One row of the guides, at one end of the tap offset.
struct GuideRow {
  const float *disparity, *dx, *dy, *nx, *ny, *nz;
};

GuideRow guide_row(const Guides& guides, const DepthDerivatives& derivatives, int y, int x) {
  return {guides.disparity.row(y) + x, derivatives.x.row(y) + x,   derivatives.y.row(y) + x,
          guides.normal_x.row(y) + x,  guides.normal_y.row(y) + x, guides.normal_z.row(y) + x};
}

struct Tolerance {
  float depth, slope;
  int normal_squarings;
};

PACKTRACE_AVX2_CLONES
void weigh_row(int width, const GuideRow& p, const GuideRow& q, float offset_x, float offset_y,
               const Tolerance& tolerance, float* __restrict scratch, uint8_t* __restrict weights) {
  const GuideRow a = p, b = q;
  const Tolerance t = tolerance;
  for (int x = 0; x < width; ++x) {
    const float difference = b.disparity[x] - a.disparity[x];
    const float rise_a = a.dx[x] * offset_x + a.dy[x] * offset_y;
    const float rise_b = b.dx[x] * offset_x + b.dy[x] * offset_y;
    const float distance = larger(std::abs(difference - rise_a), std::abs(difference - rise_b));
    // Uses the flatter of the two slopes, since one of them may be meaninglessly steep at a silhouette.
    const float allowed = t.depth * smaller(a.disparity[x], b.disparity[x]) +
                          t.slope * smaller(std::abs(rise_a), std::abs(rise_b)) + 1e-37f;
    const float depth_weight = larger(0.0f, 1.0f - distance / allowed);
    const bool both = (a.disparity[x] > 0.0f) & (b.disparity[x] > 0.0f);
    scratch[x] = both ? depth_weight * depth_weight : 0.0f;
  }
  for (int x = 0; x < width; ++x) {
    float cosine = a.nx[x] * b.nx[x] + a.ny[x] * b.ny[x] + a.nz[x] * b.nz[x];
    cosine = smaller(larger(cosine, 0.0f), 1.0f);
    for (int i = 0; i < t.normal_squarings; ++i) cosine *= cosine;
    scratch[x] *= cosine;
  }
  for (int x = 0; x < width; ++x) weights[x] = static_cast<uint8_t>(static_cast<int>(scratch[x] * 255.0f + 0.5f));
}

} // namespace

void EdgeWeights::resize(ImageSize size) {
  for (Plane<uint8_t>& plane : weights_) plane.resize(size);
}

void EdgeWeights::compute(const Guides& guides, const DepthDerivatives& derivatives, const FluxConfig& config) {
  const int width = static_cast<int>(guides.size.width);
  const Tolerance tolerance{config.blur_depth, config.blur_slope, std::countr_zero(config.blur_normal_power)};
  for_row_blocks(guides.size.height, [&](int first, int last) {
    std::vector<float> scratch(guides.size.width);
    for (int y = first; y < last; ++y) {
      const GuideRow here = guide_row(guides, derivatives, y, 0);
      for (size_t d = 0; d < kDirections.size(); ++d) {
        const int dx = step_ * kDirections[d][0], dy = step_ * kDirections[d][1];
        weigh_row(width, here, guide_row(guides, derivatives, y + dy, dx), static_cast<float>(dx),
                  static_cast<float>(dy), tolerance, scratch.data(), weights_[d].row(y));
      }
    }
  });
}

} // namespace packtrace
