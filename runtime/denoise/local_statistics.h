#pragma once

#include <cstdint>
#include <vector>

#include "runtime/denoise/plane.h"

namespace packtrace {

/// Input of the local statistics. Pixels without a sample and the border are 0 in all planes.
struct FrameSamples {
  Plane<float> ao;     ///< this frame's samples, clamped to [0,1]
  Plane<float> valid;  ///< 1 where the pixel has a sample
  Plane<float> change; ///< fast minus slow history, both including this sample

  void resize(ImageSize size) { ao.resize(size), valid.resize(size), change.resize(size); }
};

/// Statistics of the windows around the pixels of one row, one entry per pixel.
struct LocalStatistics {
  std::vector<float> count;         ///< number of samples in the window
  std::vector<float> mean;          ///< mean of the samples; 0 without samples
  std::vector<float> variance;      ///< variance of the samples, Bessel-corrected; 0 for fewer than two samples
  std::vector<float> change;        ///< mean of FrameSamples::change
  std::vector<float> narrow_count;  ///< number of samples in the 3 x 3 window
  std::vector<float> narrow_change; ///< mean of FrameSamples::change in the 3 x 3 window
};

/// Computes local statistics for rows in ascending order with separable box filters. Each row is summed along x once;
/// a ring buffer keeps the sums of the rows of the window. Use one object per thread.
class LocalStatisticsRows {
public:
  /// @param width image width in pixels
  /// @param window side of the box in pixels: odd, at most 2 kPlaneBorder + 1
  LocalStatisticsRows(uint32_t width, uint32_t window);

  /// @param first the row of the first call of at()
  void begin(const FrameSamples& samples, int first);

  /// Returns the statistics of row y, valid until the next call. Call it for rows first, first + 1, ...
  const LocalStatistics& at(const FrameSamples& samples, int y);

private:
  void add_row(const FrameSamples& samples, int y);
  float* ring_row(int quantity, int y);

  int width_, radius_;
  std::vector<float> ring_;    // [quantity][row modulo window][x]
  std::vector<float> scratch_; // squared samples of a row including its border
  LocalStatistics result_;
};

} // namespace packtrace
