#pragma once

#include <cstdint>
#include <vector>

#include "runtime/denoise/kernels/history_rows.h"
#include "runtime/denoise/plane.h"

namespace packtrace {

/// Computes sums over the windows around pixels, for rows in ascending order, with separable box filters. Each row
/// is summed along x once; a ring buffer keeps the sums of the rows of the window. Use one object per thread.
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
  void add_nothing();
  /// Returns the sums over the windows of the row in the middle of the last rows added, valid until the next call.
  WindowSums finish();

private:
  WindowSums sums(int slot);

  const HistoryKernels& kernels_;
  int width_, radius_, next_ = 0;
  size_t stride_;           // of rows, in pixels
  std::vector<float> ring_; // [slot][quantity][x]; the last slot has the sums over windows
};

} // namespace packtrace
