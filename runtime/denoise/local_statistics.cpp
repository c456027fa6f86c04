#include "runtime/denoise/local_statistics.h"

#include <algorithm>
#include <array>

namespace packtrace {
namespace {

constexpr size_t kSums = sizeof(WindowSums) / sizeof(float*);

} // namespace

LocalStatisticsRows::LocalStatisticsRows(uint32_t width, uint32_t window, const HistoryKernels& kernels)
    : kernels_(kernels), width_(static_cast<int>(width)), radius_(static_cast<int>(window / 2)),
      stride_(static_cast<size_t>(width) + kRunPadding), ring_(kSums * (window + 1) * stride_) {}

WindowSums LocalStatisticsRows::sums(int slot) {
  float* row = ring_.data() + static_cast<size_t>(slot) * kSums * stride_;
  return {row, row + stride_, row + 2 * stride_, row + 3 * stride_, row + 4 * stride_, row + 5 * stride_};
}

void LocalStatisticsRows::add(const SampleRow& samples) {
  kernels_.sum[static_cast<size_t>(radius_)](width_, samples, sums(next_));
  next_ = next_ == 2 * radius_ ? 0 : next_ + 1;
}

void LocalStatisticsRows::add_nothing() {
  std::fill_n(sums(next_).count, kSums * stride_, 0.0f);
  next_ = next_ == 2 * radius_ ? 0 : next_ + 1;
}

WindowSums LocalStatisticsRows::finish() {
  std::array<WindowSums, 2 * kMaxWindowRadius + 1> rows;
  const int window = 2 * radius_ + 1;
  for (int i = 0; i < window; ++i) rows[static_cast<size_t>(i)] = sums((next_ + i) % window);
  const WindowSums windows = sums(window);
  kernels_.add_windows[static_cast<size_t>(radius_)](width_, rows.data(), windows);
  return windows;
}

} // namespace packtrace
