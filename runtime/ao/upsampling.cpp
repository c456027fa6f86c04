#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "runtime/ao/half_resolution.h"
#include "runtime/ao/surface_similarity.h"
#include "runtime/simd.h"

namespace packtrace {
namespace {

constexpr float kMinWeight = 0.1f;      ///< smallest total weight with which a mean is used
constexpr float kMinWeightFar = 0.01f;  ///< the same for the 5 x 5 nearest blocks
constexpr uint32_t kUpsampledRows = 16; ///< rows of pixels per task

/// The half pixels of a row of blocks, with indices as in BlockSurfaces.
template <size_t kLayers>
struct BlockRow {
  BlockSurfaces surfaces;
  std::vector<float> x, y; ///< of the full pixel within its block, 0 or 1
  std::array<std::vector<float>, kLayers> ao;
};

/// A weighted mean of valid values.
struct Mean {
  float weight = 0.0f, sum = 0.0f, lo = INFINITY, hi = -INFINITY;

  [[gnu::always_inline]] void add(float w, float v) {
    const bool valid = (w > 0.0f) & (v >= 0.0f);
    weight += valid ? w : 0.0f;
    sum += valid ? w * v : 0.0f;
    lo = valid ? smaller(lo, v) : lo;
    hi = valid ? larger(hi, v) : hi;
  }
  /// kInvalidAo if the total weight is less than `least`.
  [[gnu::always_inline]] float value(float least) const {
    const float mean = sum / weight;
    return weight >= least ? larger(lo, smaller(hi, mean)) : kInvalidAo; // rounding leaves the range
  }
};

/// Means of a row's pixels, as columns.
struct MeanColumns {
  std::vector<float> weight, sum, lo, hi;

  void clear(size_t count) {
    weight.assign(count, 0.0f), sum.assign(count, 0.0f), lo.assign(count, INFINITY), hi.assign(count, -INFINITY);
  }
};

/// The half pixels that pixels are compared with: pixel k with the one at index first + k.
struct ComparedBlocks {
  PointColumns::Reader points;
  const float *x, *y, *shown;
  float left, top; ///< of the block's first pixel, relative to the pixel
  uint32_t first;
};

/// Writes the weights of one half pixel for each of `count` pixels.
PACKTRACE_AVX2_CLONES
void write_weights(uint32_t count, const PointColumns::Reader& pixels, const ComparedBlocks& blocks, float* weights) {
  const PointColumns::Reader pixel = pixels; // local copies, which the stores below cannot change
  const ComparedBlocks block = blocks;
#pragma GCC ivdep
  for (uint32_t k = 0; k < count; ++k) {
    const size_t at = size_t{k} + block.first;
    const float dx = std::abs(block.left + block.x[at]), dy = std::abs(block.top + block.y[at]);
    const float tent = larger(0.0f, 2.0f - dx) * larger(0.0f, 2.0f - dy) * 0.25f * block.shown[at];
    weights[k] = tent * similarity(relate(pixel.at(k), block.points.at(at)));
  }
}

/// Adds a value with its weight to the mean of each of `count` pixels.
PACKTRACE_AVX2_CLONES
void add_values(uint32_t count, const float* weights, const float* values, MeanColumns& columns) {
  float *const weight = columns.weight.data(), *const sum = columns.sum.data(), *const lo = columns.lo.data(),
               *const hi = columns.hi.data();
#pragma GCC ivdep
  for (uint32_t k = 0; k < count; ++k) {
    Mean mean{weight[k], sum[k], lo[k], hi[k]};
    mean.add(weights[k], values[k]);
    weight[k] = mean.weight, sum[k] = mean.sum, lo[k] = mean.lo, hi[k] = mean.hi;
  }
}

template <size_t kLayers>
class Upsampler {
public:
  using Layers = std::array<float, kLayers>; ///< values of a pixel

  Upsampler(const GBuffer& full, const HalfGBuffer& half, const std::array<std::span<const float>, kLayers>& ao)
      : full_(full), half_(half), ao_(ao) {}

  /// Writes the values of consecutive rows to arrays of all pixels.
  void upsample(uint32_t first_row, uint32_t end_row, std::array<std::vector<float>, kLayers>& out) {
    for (uint32_t y = first_row; y < end_row; ++y) {
      for (const uint32_t odd : {0u, 1u}) compute_means(y, odd);
      for (uint32_t x = 0; x < full_.size.width; ++x) {
        const Layers values = values_at(x, y);
        for (size_t i = 0; i < kLayers; ++i) out[i][size_t{y} * full_.size.width + x] = values[i];
      }
    }
  }

private:
  /// Computes the means of the even or the odd columns of a row over the four nearest blocks. A half pixel less than
  /// two full pixels away belongs to the pixel's own block or to the closer neighbouring block on each axis: the one
  /// before for the first pixel of a block, the one after for the second.
  void compute_means(uint32_t y, uint32_t odd) {
    const uint32_t count = (full_.size.width + 1 - odd) / 2;
    pixels_.resize(count), weights_.resize(count);
    for (uint32_t k = 0; k < count; ++k)
      pixels_.set(k, pixel_surface(full_, size_t{y} * full_.size.width + 2 * k + odd));
    for (MeanColumns& layer : means_[odd]) layer.clear(count);
    const uint32_t upper = y / 2 + y % 2; // rows of blocks are counted from 1
    for (const uint32_t by : {upper, upper + 1}) {
      const BlockRow<kLayers>& row = blocks(by);
      const float top = static_cast<float>(2 * by) - static_cast<float>(y + 2);
      for (const uint32_t first : {odd, odd + 1}) {
        const float left = 2.0f * static_cast<float>(first) - static_cast<float>(2 + odd);
        write_weights(
            count, pixels_.reader(),
            {row.surfaces.points.reader(), row.x.data(), row.y.data(), row.surfaces.shown.data(), left, top, first},
            weights_.data());
        for (size_t i = 0; i < kLayers; ++i)
          add_values(count, weights_.data(), row.ao[i].data() + first, means_[odd][i]);
      }
    }
  }

  /// The row of blocks with a number: BlockSurfaces::load().
  const BlockRow<kLayers>& blocks(uint32_t number) {
    return rows_.at(number, [&](BlockRow<kLayers>& row) { load(number, row); });
  }

  void load(uint32_t number, BlockRow<kLayers>& row) const {
    const ImageSize size = half_.gbuffer.size;
    row.surfaces.load(full_, size, half_.pixel, number);
    row.x.resize(size.width + 2), row.y.resize(size.width + 2);
    for (std::vector<float>& layer : row.ao) layer.resize(size.width + 2);
    if (number == 0 || number > size.height) return;
    for (uint32_t bx = 0; bx < size.width; ++bx) {
      const size_t from = size_t{number - 1} * size.width + bx, to = bx + 1;
      const uint32_t x = half_.pixel[from] % full_.size.width, y = half_.pixel[from] / full_.size.width;
      row.x[to] = static_cast<float>(x - 2 * bx), row.y[to] = static_cast<float>(y - 2 * (number - 1));
      for (size_t i = 0; i < kLayers; ++i) row.ao[i][to] = ao_[i][from];
    }
  }

  Layers values_at(uint32_t x, uint32_t y) const {
    const size_t pixel = size_t{y} * full_.size.width + x;
    Layers values;
    if (!is_hit(full_, pixel)) {
      values.fill(kInvalidAo);
      return values;
    }
    if (const size_t own = size_t{y / 2} * half_.gbuffer.size.width + x / 2; half_.pixel[own] == pixel) return at(own);
    for (size_t i = 0; i < kLayers; ++i) values[i] = nearest_mean(means_[x % 2][i], x / 2);
    if (std::ranges::all_of(values, is_value)) return values;
    const Layers others = values_around(x, y, pixel);
    for (size_t i = 0; i < kLayers; ++i)
      if (!is_value(values[i])) values[i] = others[i];
    return values;
  }

  static bool is_value(float ao) { return ao >= 0.0f; }
  static float nearest_mean(const MeanColumns& m, size_t k) {
    return Mean{m.weight[k], m.sum[k], m.lo[k], m.hi[k]}.value(kMinWeight);
  }
  Layers at(size_t i) const {
    Layers v;
    for (size_t layer = 0; layer < kLayers; ++layer) v[layer] = ao_[layer][i];
    return v;
  }

  /// Means over the 5 x 5 nearest blocks.
  Layers values_around(uint32_t x, uint32_t y, size_t pixel) const {
    std::array<Mean, kLayers> far, unlike;
    const PixelSurface point = pixel_surface(full_, pixel);
    const ImageSize size = half_.gbuffer.size;
    const uint32_t bx = x / 2, by = y / 2;
    for (uint32_t ny = by > 2 ? by - 2 : 0; ny <= std::min(size.height - 1, by + 2); ++ny)
      for (uint32_t nx = bx > 2 ? bx - 2 : 0; nx <= std::min(size.width - 1, bx + 2); ++nx) {
        const size_t i = size_t{ny} * size.width + nx;
        if (!is_hit(half_.gbuffer, i)) continue;
        const float closeness = 1.0f / (1.0f + distance2(x, y, half_.pixel[i]));
        const Relation r = relate(point, pixel_surface(full_, half_.pixel[i]));
        const float similar = (1.0f + r.cosine) * (1.0f - r.slope2);
        const float weight = closeness * similarity(r);
        const float weight_unlike = closeness * (similar > 0.0f ? similar * similar + 1e-6f : 1e-6f);
        for (size_t layer = 0; layer < kLayers; ++layer) {
          far[layer].add(weight, ao_[layer][i]);
          unlike[layer].add(weight_unlike, ao_[layer][i]);
        }
      }
    Layers values;
    for (size_t layer = 0; layer < kLayers; ++layer) {
      values[layer] = far[layer].value(kMinWeightFar);
      if (!is_value(values[layer])) values[layer] = unlike[layer].value(std::numeric_limits<float>::min());
    }
    return values;
  }

  /// Squared distance of two full pixels.
  float distance2(uint32_t x, uint32_t y, uint32_t pixel) const {
    const uint32_t column = pixel % full_.size.width, row = pixel / full_.size.width;
    const float dx = static_cast<float>(column) - static_cast<float>(x);
    const float dy = static_cast<float>(row) - static_cast<float>(y);
    return dx * dx + dy * dy;
  }

  const GBuffer& full_;
  const HalfGBuffer& half_;
  const std::array<std::span<const float>, kLayers> ao_;
  RowCache<BlockRow<kLayers>, 2> rows_;
  PointColumns pixels_;                                   ///< of a row's even or odd columns
  std::vector<float> weights_;                            ///< per element of pixels_: of the half pixel that is added
  std::array<std::array<MeanColumns, kLayers>, 2> means_; ///< of a row's even and odd columns
};

} // namespace

template <size_t kLayers>
std::array<std::vector<float>, kLayers> upsample_ao(const GBuffer& full, const HalfGBuffer& half,
                                                    const std::array<std::span<const float>, kLayers>& layers) {
  std::array<std::vector<float>, kLayers> result;
  for (std::vector<float>& layer : result) layer.resize(full.size.pixels());
  tbb::parallel_for(tbb::blocked_range<uint32_t>(0, full.size.height, kUpsampledRows),
                    [&](const tbb::blocked_range<uint32_t>& range) {
                      Upsampler<kLayers>(full, half, layers).upsample(range.begin(), range.end(), result);
                    });
  return result;
}

template std::array<std::vector<float>, 1> upsample_ao(const GBuffer&, const HalfGBuffer&,
                                                       const std::array<std::span<const float>, 1>&);
template std::array<std::vector<float>, 2> upsample_ao(const GBuffer&, const HalfGBuffer&,
                                                       const std::array<std::span<const float>, 2>&);

} // namespace packtrace
