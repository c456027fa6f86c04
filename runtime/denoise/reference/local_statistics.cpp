#include "runtime/denoise/reference/local_statistics.h"

#include <algorithm>
#include <limits>

#include "runtime/denoise/reference/row_math.h"

namespace packtrace::reference {
namespace {

constexpr size_t kQuantities = 3; // count, sum, sum of squares

PACKTRACE_AVX2_CLONES
void load_samples(int width, const float* __restrict ao, float* __restrict valid, float* __restrict value,
                  float* __restrict square) {
  for (int x = 0; x < width; ++x) {
    const bool sampled = (ao[x] >= 0.0f) & (ao[x] <= std::numeric_limits<float>::max());
    const float v = sampled ? smaller(1.0f, ao[x]) : 0.0f;
    valid[x] = sampled ? 1.0f : 0.0f;
    value[x] = v;
    square[x] = v * v;
  }
}

/// Sums along x over [x - radius, x + radius], radius >= 1.
PACKTRACE_AVX2_CLONES
void sum_window_row(int width, int radius, const float* __restrict in, float* __restrict out) {
  for (int x = 0; x < width; ++x) out[x] = in[x - 1] + in[x] + in[x + 1];
  for (int r = 2; r <= radius; ++r)
    for (int x = 0; x < width; ++x) out[x] += in[x - r] + in[x + r];
}

PACKTRACE_AVX2_CLONES
void add_window_rows(int width, const float* __restrict above, const float* __restrict below, float* __restrict out) {
  for (int x = 0; x < width; ++x) out[x] += above[x] + below[x];
}

/// Turns sums into the mean and the variance, in place.
PACKTRACE_AVX2_CLONES
void finish_statistics(int width, const float* __restrict count, float* __restrict mean, float* __restrict variance) {
  for (int x = 0; x < width; ++x) {
    const float n = larger(1.0f, count[x]);
    const float m = mean[x] / n;
    const float squares = larger(0.0f, variance[x] - mean[x] * m);
    mean[x] = m;
    variance[x] = count[x] > 1.0f ? squares / (n - 1.0f) : 0.0f;
  }
}

} // namespace

LocalStatisticsRows::LocalStatisticsRows(ImageSize size, uint32_t window)
    : width_(static_cast<int>(size.width)), height_(static_cast<int>(size.height)),
      radius_(static_cast<int>(window / 2)), ring_(kQuantities * window * size.width) {
  for (auto* row : {&valid_, &value_, &square_}) row->resize(size_t{size.width} + 2 * kPlaneBorder);
  for (auto* row : {&result_.count, &result_.mean, &result_.variance}) row->resize(size.width);
}

float* LocalStatisticsRows::ring_row(size_t quantity, int y) {
  const size_t window = 2 * static_cast<size_t>(radius_) + 1;
  const size_t slot = static_cast<size_t>(y + kPlaneBorder) % window;
  return ring_.data() + (quantity * window + slot) * static_cast<size_t>(width_);
}

void LocalStatisticsRows::add_row(std::span<const float> ao, int y) {
  if (y < 0 || y >= height_) {
    for (size_t quantity = 0; quantity < kQuantities; ++quantity) std::fill_n(ring_row(quantity, y), width_, 0.0f);
    return;
  }
  const size_t begin = static_cast<size_t>(y) * static_cast<size_t>(width_);
  load_samples(width_, &ao[begin], valid_.data() + kPlaneBorder, value_.data() + kPlaneBorder,
               square_.data() + kPlaneBorder);
  sum_window_row(width_, radius_, valid_.data() + kPlaneBorder, ring_row(0, y));
  sum_window_row(width_, radius_, value_.data() + kPlaneBorder, ring_row(1, y));
  sum_window_row(width_, radius_, square_.data() + kPlaneBorder, ring_row(2, y));
}

void LocalStatisticsRows::begin(std::span<const float> ao, int first) {
  for (int y = first - radius_; y < first + radius_; ++y) add_row(ao, y);
}

const LocalStatistics& LocalStatisticsRows::at(std::span<const float> ao, int y) {
  add_row(ao, y + radius_);
  std::vector<float>* const sums[kQuantities] = {&result_.count, &result_.mean, &result_.variance};
  for (size_t quantity = 0; quantity < kQuantities; ++quantity) {
    float* out = sums[quantity]->data();
    std::copy_n(ring_row(quantity, y), width_, out);
    for (int r = 1; r <= radius_; ++r)
      add_window_rows(width_, ring_row(quantity, y - r), ring_row(quantity, y + r), out);
  }
  finish_statistics(width_, result_.count.data(), result_.mean.data(), result_.variance.data());
  return result_;
}

} // namespace packtrace::reference
