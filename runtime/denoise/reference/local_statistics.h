#pragma once

#include <span>
#include <vector>

#include "runtime/denoise/plane.h"

namespace packtrace::reference {

/// Statistics of the samples in the windows around the pixels of one row, one entry per pixel.
struct LocalStatistics {
  std::vector<float> count;    ///< number of samples
  std::vector<float> mean;     ///< 0 without samples
  std::vector<float> variance; ///< Bessel-corrected, not negative; 0 for fewer than two samples
};

/// Local mean and variance of a frame's samples, as separable box sums. Pixels without a sample and those outside the
/// image are not counted; they get the statistics of their neighbours like all others. Rows are summed along x once,
/// and a ring buffer keeps the sums of the rows of the window.
class LocalStatisticsRows {
public:
  /// @param window side of the box in pixels: odd, at most 2 kPlaneBorder + 1
  LocalStatisticsRows(ImageSize size, uint32_t window);

  /// @param first row of the first call of at()
  void begin(std::span<const float> ao, int first);
  /// Returns the statistics of row y, valid until the next call. Call it for rows first, first + 1, ...
  /// @param ao one value per pixel; negative and non-finite values are no samples, values above 1 count as 1
  const LocalStatistics& at(std::span<const float> ao, int y);

private:
  void add_row(std::span<const float> ao, int y);
  float* ring_row(size_t quantity, int y);

  int width_, height_, radius_;
  std::vector<float> valid_, value_, square_; ///< of a row, with a border of kPlaneBorder zeros on each side
  std::vector<float> ring_;                   ///< [quantity][row modulo window][x]
  LocalStatistics result_;
};

} // namespace packtrace::reference
