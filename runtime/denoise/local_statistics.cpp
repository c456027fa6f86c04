#include "runtime/denoise/local_statistics.h"

#include <array>

namespace packtrace {
namespace {

constexpr int kSums = sizeof(WindowSums) / sizeof(float*), kResults = sizeof(LocalRow) / sizeof(float*);

} // namespace

LocalStatisticsRows::LocalStatisticsRows(uint32_t width, uint32_t window, const HistoryKernels& kernels)
    : kernels_(kernels), width_(static_cast<int>(width)), radius_(static_cast<int>(window / 2)),
      ring_(static_cast<size_t>(kSums) * window * width), result_(static_cast<size_t>(kResults) * width) {}

WindowSums LocalStatisticsRows::sums(int slot) {
  const size_t width = static_cast<size_t>(width_);
  float* row = ring_.data() + static_cast<size_t>(slot * kSums) * width;
  return {row, row + width, row + 2 * width, row + 3 * width, row + 4 * width, row + 5 * width};
}

void LocalStatisticsRows::add(const SampleRow& samples) {
  kernels_.sum[static_cast<size_t>(radius_)](width_, samples, sums(next_));
  next_ = next_ == 2 * radius_ ? 0 : next_ + 1;
}

void LocalStatisticsRows::add_nothing() {
  std::fill_n(sums(next_).count, kSums * width_, 0.0f);
  next_ = next_ == 2 * radius_ ? 0 : next_ + 1;
}

LocalRow LocalStatisticsRows::finish() {
  std::array<WindowSums, 2 * kMaxWindowRadius + 1> rows;
  const int window = 2 * radius_ + 1;
  for (int i = 0; i < window; ++i) rows[static_cast<size_t>(i)] = sums((next_ + i) % window);
  const size_t width = static_cast<size_t>(width_);
  float* r = result_.data();
  const LocalRow local{r, r + width, r + 2 * width, r + 3 * width, r + 4 * width};
  kernels_.finish[static_cast<size_t>(radius_)](width_, rows.data(), local);
  return local;
}

} // namespace packtrace
