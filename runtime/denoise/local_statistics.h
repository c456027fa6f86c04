#pragma once

#include <cstdint>
#include <vector>

#include "runtime/denoise/kernels/history_rows.h"
#include "runtime/denoise/plane.h"

namespace packtrace {

/// Computes sums over the windows around pixels, for rows in ascending order, with separable box filters. Each row
/// is summed along x once; a ring buffer keeps the sums of the rows of the window, and the sums over windows change by
/// those of the rows that enter and leave them. Use one object per thread.
class LocalStatisticsRows {
public:
  /// @param width image width in pixels
  /// @param window side of the box in pixels: odd, at most 2 kMaxWindowRadius + 1
  LocalStatisticsRows(uint32_t width, uint32_t window, const HistoryKernels& kernels);

  /// Rows above and below that a row's windows reach.
  int radius() const { return radius_; }

  /// Adds the next row of samples, valid up to kPlaneBorder pixels outside the image.
  void add(const SampleRow& samples);
  /// Adds a row outside the image.
  void add_nothing() { add(nothing()); }
  /// Returns the sums over the windows of the row in the middle of the last rows added, valid until the next call.
  WindowRow finish();

private:
  WindowSums sums(int slot);
  SampleRow nothing() {
    int32_t* row = nothing_.data() + kPlaneBorder;
    return {row, row, row};
  }

  const HistoryKernels& kernels_;
  int width_, radius_, next_ = 0;
  size_t stride_;             // of rows, in pixels
  std::vector<int32_t> ring_; // [slot][quantity][x]
  std::vector<int32_t> windows_, nothing_;
  WindowRow row_; // of windows_
};

} // namespace packtrace
