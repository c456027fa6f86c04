#include "runtime/denoise/edge_blur.h"

#include <algorithm>
#include <utility>

#include "runtime/denoise/simd.h"

namespace packtrace {
namespace {

constexpr float kAside = 0.27901f, kCentre = 0.44198f;
constexpr float kStraight = kAside * kCentre / 255.0f; // Gaussian and the scale of edge weights
constexpr float kDiagonal = kAside * kAside / 255.0f;

/// What a row reads: values and precisions of it and the rows one step above and below, and the edge weights that leave
/// it and the row above.
struct BlurRow {
  const float *value, *value_above, *value_below;
  const float *precision, *precision_above, *precision_below;
  const uint8_t *right, *down, *down_right, *down_left;
  const uint8_t *above_down, *above_down_right, *above_down_left;
  const float* samples;
  float *out_value, *out_precision;
};

struct Sums {
  float flux = 0, taken = 0, squares = 0;
};

inline void add_tap(Sums& sums, float value, float other, float precision, float other_precision, uint8_t edge,
                    float gaussian, float scale) {
  const float difference = other - value;
  const float keep = larger(0.0f, 1.0f - difference * difference * scale * smaller(precision, other_precision));
  const float weight = static_cast<float>(static_cast<int>(edge)) * gaussian * (keep * keep);
  sums.flux += weight * difference;
  sums.taken += weight;
  sums.squares += weight * weight;
}

PACKTRACE_AVX2_CLONES
void blur_row(int width, ptrdiff_t step, const BlurRow& rows, Fade fade, float scale) {
  const BlurRow r = rows;
  const float fade_scale = 1.0f / (fade.end - fade.begin);
#pragma GCC ivdep
  for (ptrdiff_t x = 0; x < width; ++x) {
    const float v = r.value[x], p = r.precision[x];
    Sums sums;
    add_tap(sums, v, r.value[x + step], p, r.precision[x + step], r.right[x], kStraight, scale);
    add_tap(sums, v, r.value[x - step], p, r.precision[x - step], r.right[x - step], kStraight, scale);
    add_tap(sums, v, r.value_below[x], p, r.precision_below[x], r.down[x], kStraight, scale);
    add_tap(sums, v, r.value_above[x], p, r.precision_above[x], r.above_down[x], kStraight, scale);
    add_tap(sums, v, r.value_below[x + step], p, r.precision_below[x + step], r.down_right[x], kDiagonal, scale);
    add_tap(sums, v, r.value_above[x - step], p, r.precision_above[x - step], r.above_down_right[x - step], kDiagonal,
            scale);
    add_tap(sums, v, r.value_below[x - step], p, r.precision_below[x - step], r.down_left[x], kDiagonal, scale);
    add_tap(sums, v, r.value_above[x + step], p, r.precision_above[x + step], r.above_down_left[x + step], kDiagonal,
            scale);
    const float strength = smaller(larger((fade.end - r.samples[x]) * fade_scale, 0.0f), 1.0f);
    const float kept = 1.0f - strength * sums.taken;
    r.out_value[x] = v + strength * sums.flux;
    r.out_precision[x] = p / (kept * kept + strength * strength * sums.squares);
  }
}

BlurRow make_row(const NoisyImage& in, const EdgeWeights& edges, const Plane<float>& samples, int y, NoisyImage& out) {
  const int above = y - edges.step(), below = y + edges.step();
  return {in.value.row(y),
          in.value.row(above),
          in.value.row(below),
          in.precision.row(y),
          in.precision.row(above),
          in.precision.row(below),
          edges.direction(0).row(y),
          edges.direction(1).row(y),
          edges.direction(2).row(y),
          edges.direction(3).row(y),
          edges.direction(1).row(above),
          edges.direction(2).row(above),
          edges.direction(3).row(above),
          samples.row(y),
          out.value.row(y),
          out.precision.row(y)};
}

} // namespace

void edge_blur(const EdgeWeights& edges, const Plane<float>& samples, Fade fade, float sigma, ImageSize size,
               NoisyImage& image, NoisyImage& scratch) {
  if (std::none_of(image.youngest.begin(), image.youngest.end(), [&](float tspp) { return tspp < fade.end; })) return;
  const int width = static_cast<int>(size.width);
  const float scale = 0.5f / (sigma * sigma);
  for_row_blocks(size.height, [&](int first, int last) {
    for (int y = first; y < last; ++y) {
      if (image.youngest[static_cast<size_t>(y)] < fade.end) {
        blur_row(width, edges.step(), make_row(image, edges, samples, y, scratch), fade, scale);
      } else {
        std::copy_n(image.value.row(y), width, scratch.value.row(y));
        std::copy_n(image.precision.row(y), width, scratch.precision.row(y));
      }
    }
  });
  std::swap(image.value, scratch.value);
  std::swap(image.precision, scratch.precision);
}

} // namespace packtrace
