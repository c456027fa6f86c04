#include "runtime/denoise/edge_blur.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "runtime/denoise/simd.h"

namespace packtrace {
namespace {

constexpr float kAside = 0.27901f, kCentre = 0.44198f;
constexpr float kStraight = kAside * kCentre / 255.0f; // Gaussian weight divided by the largest edge weight
constexpr float kDiagonal = kAside * kAside / 255.0f;

/// Patches count as equal up to this mean squared difference in units of the noise variance. It is slightly above the
/// expected value 1 to allow for scatter.
constexpr float kNoise = 1.2f;

/// For two rows of pixels: squared differences in units of the noise variance, and a flag (0 or 1) whether both pixels
/// lie on the same surface. The difference is 0 where they do not.
PACKTRACE_AVX2_CLONES
void compare_row(int begin, int end, const float* __restrict value, const float* __restrict other,
                 const float* __restrict inverse_variance, const float* __restrict other_inverse_variance,
                 const uint8_t* __restrict edge, float* __restrict distance, uint8_t* __restrict same) {
  for (int x = begin; x < end; ++x) {
    const float difference = other[x] - value[x];
    const float noise_units = difference * difference * smaller(inverse_variance[x], other_inverse_variance[x]);
    distance[x] = edge[x] != 0 ? noise_units : 0.0f;
  }
  for (int x = begin; x < end; ++x) same[x] = edge[x] != 0 ? 1 : 0;
}

/// Results of compare_row() for three consecutive rows.
struct Patch {
  const float* distance[3];
  const uint8_t* same[3];
};

/// Writes edge weight times value weight for a row. Columns [-1, width] of `patch` and of the two column buffers must
/// be valid.
PACKTRACE_AVX2_CLONES
void weigh_row(int width, const Patch& patch, float limit, const uint8_t* __restrict edge, float* __restrict column,
               uint8_t* __restrict same_column, uint8_t* __restrict weights) {
  const float* __restrict d0 = patch.distance[0];
  const float* __restrict d1 = patch.distance[1];
  const float* __restrict d2 = patch.distance[2];
  for (int x = -1; x <= width; ++x) column[x] = d0[x] + d1[x] + d2[x];
  const uint8_t* __restrict s0 = patch.same[0];
  const uint8_t* __restrict s1 = patch.same[1];
  const uint8_t* __restrict s2 = patch.same[2];
  for (int x = -1; x <= width; ++x) same_column[x] = static_cast<uint8_t>(s0[x] + s1[x] + s2[x]);
  const float slope = 1.0f / (limit - kNoise);
  for (int x = 0; x < width; ++x) {
    const float sum = column[x - 1] + column[x] + column[x + 1];
    const float count = static_cast<float>(same_column[x - 1] + same_column[x] + same_column[x + 1]);
    const float keep = smaller(larger((limit - 0.5f * sum / larger(count, 1.0f)) * slope, 0.0f), 1.0f);
    const float weight = static_cast<float>(static_cast<int>(edge[x])) * (keep * keep);
    weights[x] = static_cast<uint8_t>(static_cast<int>(weight + 0.5f));
  }
}

/// Ring buffer of the three rows that weigh_row() needs for one direction, plus its column sums.
class PatchRows {
public:
  explicit PatchRows(int width) : stride_(static_cast<size_t>(width) + 2), distance_(4 * stride_), same_(4 * stride_) {}

  float* distance(int y) { return distance_.data() + slot(y); }
  uint8_t* same(int y) { return same_.data() + slot(y); }
  float* column() { return distance_.data() + 3 * stride_ + 1; }
  uint8_t* same_column() { return same_.data() + 3 * stride_ + 1; }
  Patch patch(int y) { return {{distance(y - 1), distance(y), distance(y + 1)}, {same(y - 1), same(y), same(y + 1)}}; }

private:
  size_t slot(int y) const { return static_cast<size_t>((y + 3) % 3) * stride_ + 1; }
  size_t stride_;
  std::vector<float> distance_;
  std::vector<uint8_t> same_;
};

void weigh_values(const NoisyImage& image, const EdgeWeights& edges, size_t direction, float limit, int width,
                  int first, int last, Plane<uint8_t>& weights) {
  const int dx = edges.step() * EdgeWeights::kDirections[direction][0];
  const int dy = edges.step() * EdgeWeights::kDirections[direction][1];
  const Plane<uint8_t>& edge = edges.direction(direction);
  PatchRows rows(width);
  const auto compare = [&](int y) {
    compare_row(-1, width + 1, image.value.row(y), image.value.row(y + dy) + dx, image.inverse_variance.row(y),
                image.inverse_variance.row(y + dy) + dx, edge.row(y), rows.distance(y), rows.same(y));
  };
  compare(first - 1), compare(first);
  for (int y = first; y < last; ++y) {
    compare(y + 1);
    weigh_row(width, rows.patch(y), limit, edge.row(y), rows.column(), rows.same_column(), weights.row(y));
  }
}

/// Inputs and outputs of blur_row(): values of the row and of the rows one step above and below, and weights of the
/// directions that start in the row or in the row one step above.
struct BlurRow {
  const float *value, *value_above, *value_below, *inverse_variance, *samples;
  const uint8_t *right, *down, *down_right, *down_left;
  const uint8_t *above_down, *above_down_right, *above_down_left;
  float *out_value, *out_inverse_variance;
};

struct Sums {
  float flux = 0, taken = 0, squares = 0;

  void add(float difference, uint8_t weight, float gaussian) {
    const float w = static_cast<float>(static_cast<int>(weight)) * gaussian;
    flux += w * difference;
    taken += w;
    squares += w * w;
  }
};

PACKTRACE_AVX2_CLONES
void blur_row(int width, ptrdiff_t step, const BlurRow& rows, Fade fade) {
  const BlurRow r = rows;
  const float fade_scale = 1.0f / (fade.end - fade.begin);
#pragma GCC ivdep
  for (ptrdiff_t x = 0; x < width; ++x) {
    const float v = r.value[x];
    Sums sums;
    sums.add(r.value[x + step] - v, r.right[x], kStraight);
    sums.add(r.value[x - step] - v, r.right[x - step], kStraight);
    sums.add(r.value_below[x] - v, r.down[x], kStraight);
    sums.add(r.value_above[x] - v, r.above_down[x], kStraight);
    sums.add(r.value_below[x + step] - v, r.down_right[x], kDiagonal);
    sums.add(r.value_above[x - step] - v, r.above_down_right[x - step], kDiagonal);
    sums.add(r.value_below[x - step] - v, r.down_left[x], kDiagonal);
    sums.add(r.value_above[x + step] - v, r.above_down_left[x + step], kDiagonal);
    const float strength = smaller(larger((fade.end - r.samples[x]) * fade_scale, 0.0f), 1.0f);
    const float kept = 1.0f - strength * sums.taken;
    r.out_value[x] = v + strength * sums.flux;
    // The square root halves the predicted gain as an exponent: large noise differences get smaller weights, so less
    // noise is removed than the weights suggest.
    r.out_inverse_variance[x] = r.inverse_variance[x] / std::sqrt(kept * kept + strength * strength * sums.squares);
  }
}

BlurRow make_row(const NoisyImage& image, int step, const Plane<float>& samples, int y, BlurScratch& scratch) {
  const auto& weights = scratch.weights;
  return {image.value.row(y),
          image.value.row(y - step),
          image.value.row(y + step),
          image.inverse_variance.row(y),
          samples.row(y),
          weights[0].row(y),
          weights[1].row(y),
          weights[2].row(y),
          weights[3].row(y),
          weights[1].row(y - step),
          weights[2].row(y - step),
          weights[3].row(y - step),
          scratch.image.value.row(y),
          scratch.image.inverse_variance.row(y)};
}

} // namespace

void edge_blur(const EdgeWeights& edges, const Plane<float>& samples, Fade fade, float limit, ImageSize size,
               NoisyImage& image, BlurScratch& scratch) {
  if (std::none_of(image.min_tspp.begin(), image.min_tspp.end(), [&](float tspp) { return tspp < fade.end; })) return;
  const int width = static_cast<int>(size.width);
  for_row_blocks(size.height, [&](int first, int last) {
    for (size_t direction = 0; direction < EdgeWeights::kDirections.size(); ++direction)
      weigh_values(image, edges, direction, limit, width, first, last, scratch.weights[direction]);
  });
  for_row_blocks(size.height, [&](int first, int last) {
    for (int y = first; y < last; ++y) {
      if (image.min_tspp[static_cast<size_t>(y)] < fade.end) {
        blur_row(width, edges.step(), make_row(image, edges.step(), samples, y, scratch), fade);
      } else {
        std::copy_n(image.value.row(y), width, scratch.image.value.row(y));
        std::copy_n(image.inverse_variance.row(y), width, scratch.image.inverse_variance.row(y));
      }
    }
  });
  std::swap(image.value, scratch.image.value);
  std::swap(image.inverse_variance, scratch.image.inverse_variance);
}

} // namespace packtrace
