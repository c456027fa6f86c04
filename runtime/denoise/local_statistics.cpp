#include "runtime/denoise/local_statistics.h"

#include "runtime/denoise/simd.h"

namespace packtrace {
namespace {

enum Quantity : int { kCount, kSum, kSquares, kChange, kNarrowCount, kNarrowChange, kQuantities };

/// Sums along x over [x - radius, x + radius], radius >= 1.
PACKTRACE_AVX2_CLONES
void sum_row(int width, int radius, const float* __restrict in, float* __restrict out) {
  for (int x = 0; x < width; ++x) out[x] = in[x - 1] + in[x] + in[x + 1];
  int r = 2;
  for (; r + 1 <= radius; r += 2) // two distances per pass over `out` save memory traffic
    for (int x = 0; x < width; ++x) out[x] += (in[x - r] + in[x + r]) + (in[x - r - 1] + in[x + r + 1]);
  if (r <= radius)
    for (int x = 0; x < width; ++x) out[x] += in[x - r] + in[x + r];
}

PACKTRACE_AVX2_CLONES
void square_row(int begin, int end, const float* __restrict in, float* __restrict out) {
  for (int x = begin; x < end; ++x) out[x] = in[x] * in[x];
}

PACKTRACE_AVX2_CLONES
void add_rows(int width, const float* __restrict a, const float* __restrict b, const float* __restrict c,
              float* __restrict out) {
  for (int x = 0; x < width; ++x) out[x] = a[x] + b[x] + c[x];
}

PACKTRACE_AVX2_CLONES
void add_two_rows(int width, const float* __restrict a, const float* __restrict b, float* __restrict out) {
  for (int x = 0; x < width; ++x) out[x] += a[x] + b[x];
}

/// Turns window sums into means and the Bessel-corrected variance, in place.
PACKTRACE_AVX2_CLONES
void finish_row(int width, const float* __restrict count, float* __restrict mean, float* __restrict variance,
                float* __restrict change, const float* __restrict narrow_count, float* __restrict narrow_change) {
  for (int x = 0; x < width; ++x) {
    const float n = larger(count[x], 1.0f);
    const float m = mean[x] / n;
    const float squares = variance[x] - mean[x] * m;
    mean[x] = m;
    variance[x] = count[x] > 1.0f ? larger(squares, 0.0f) / larger(n - 1.0f, 1.0f) : 0.0f;
    change[x] /= n;
    narrow_change[x] /= larger(narrow_count[x], 1.0f);
  }
}

} // namespace

LocalStatisticsRows::LocalStatisticsRows(uint32_t width, uint32_t window)
    : width_(static_cast<int>(width)), radius_(static_cast<int>(window / 2)),
      ring_(static_cast<size_t>(kQuantities) * window * width),
      scratch_(static_cast<size_t>(width) + 2 * kPlaneBorder) {
  for (auto* row : {&result_.count, &result_.mean, &result_.variance, &result_.change, &result_.narrow_count,
                    &result_.narrow_change})
    row->resize(width);
}

float* LocalStatisticsRows::ring_row(int quantity, int y) {
  const int window = 2 * radius_ + 1;
  const int slot = (y + kPlaneBorder) % window;
  return ring_.data() + static_cast<size_t>(quantity * window + slot) * static_cast<size_t>(width_);
}

void LocalStatisticsRows::add_row(const FrameSamples& samples, int y) {
  float* squares = scratch_.data() + kPlaneBorder;
  square_row(-radius_, width_ + radius_, samples.ao.row(y), squares);
  sum_row(width_, radius_, samples.valid.row(y), ring_row(kCount, y));
  sum_row(width_, radius_, samples.ao.row(y), ring_row(kSum, y));
  sum_row(width_, radius_, squares, ring_row(kSquares, y));
  sum_row(width_, radius_, samples.change.row(y), ring_row(kChange, y));
  sum_row(width_, 1, samples.valid.row(y), ring_row(kNarrowCount, y));
  sum_row(width_, 1, samples.change.row(y), ring_row(kNarrowChange, y));
}

void LocalStatisticsRows::begin(const FrameSamples& samples, int first) {
  for (int y = first - radius_; y < first + radius_; ++y) add_row(samples, y);
}

const LocalStatistics& LocalStatisticsRows::at(const FrameSamples& samples, int y) {
  add_row(samples, y + radius_);
  std::vector<float>* const sums[kQuantities] = {&result_.count,  &result_.mean,         &result_.variance,
                                                 &result_.change, &result_.narrow_count, &result_.narrow_change};
  for (int quantity = 0; quantity < kQuantities; ++quantity) {
    const int radius = quantity < kNarrowCount ? radius_ : 1;
    float* out = sums[quantity]->data();
    add_rows(width_, ring_row(quantity, y - 1), ring_row(quantity, y), ring_row(quantity, y + 1), out);
    for (int r = 2; r <= radius; ++r) add_two_rows(width_, ring_row(quantity, y - r), ring_row(quantity, y + r), out);
  }
  finish_row(width_, result_.count.data(), result_.mean.data(), result_.variance.data(), result_.change.data(),
             result_.narrow_count.data(), result_.narrow_change.data());
  return result_;
}

} // namespace packtrace
