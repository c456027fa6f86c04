#include "runtime/denoise/local_statistics.h"

namespace packtrace {
namespace {

constexpr size_t kSums = sizeof(WindowSums) / sizeof(int32_t*);

} // namespace

LocalStatisticsRows::LocalStatisticsRows(uint32_t width, uint32_t window, const HistoryKernels& kernels)
    : kernels_(kernels), width_(static_cast<int>(width)), radius_(static_cast<int>(window / 2)),
      stride_(static_cast<size_t>(width) + kRunPadding), ring_(kSums * window * stride_), windows_(3 * stride_),
      nothing_(stride_ + 2 * size_t{kPlaneBorder}),
      row_{windows_.data(), windows_.data() + stride_, windows_.data() + 2 * stride_, {}, {}} {}

WindowSums LocalStatisticsRows::sums(int slot) {
  int32_t* row = ring_.data() + static_cast<size_t>(slot) * kSums * stride_;
  return {row, row + stride_, row + 2 * stride_, row + 3 * stride_, row + 4 * stride_};
}

void LocalStatisticsRows::add(const SampleRow& samples) {
  kernels_.sum[static_cast<size_t>(radius_)](width_, samples, sums(next_), row_);
  next_ = next_ == 2 * radius_ ? 0 : next_ + 1;
}

WindowRow LocalStatisticsRows::finish() {
  for (int i = 0; i < 3; ++i) {
    const WindowSums sums_of_row = sums((next_ + radius_ - 1 + i) % (2 * radius_ + 1));
    row_.narrow_value[static_cast<size_t>(i)] = sums_of_row.narrow_value;
    row_.narrow_change[static_cast<size_t>(i)] = sums_of_row.narrow_change;
  }
  return row_;
}

} // namespace packtrace
