#pragma once

#include <cstdint>
#include <vector>

#include "runtime/denoise/plane.h"

namespace packtrace {

/// The planes that local statistics are taken of; invalid pixels and the border are 0 in all of them.
struct FrameSamples {
  Plane<float> ao;     ///< this frame's samples, sanitised
  Plane<float> valid;  ///< 1 where there is one
  Plane<float> change; ///< fast minus slow history after both took the sample

  void resize(ImageSize size) { ao.resize(size), valid.resize(size), change.resize(size); }
};

/// Statistics of the windows around the pixels of one row.
struct LocalStatistics {
  std::vector<float> count;         ///< samples in the window
  std::vector<float> mean;          ///< of the samples; 0 where there are none
  std::vector<float> variance;      ///< of the samples, Bessel-corrected; 0 for fewer than two
  std::vector<float> change;        ///< mean of `change`
  std::vector<float> narrow_count;  ///< samples in the 3 x 3 window
  std::vector<float> narrow_change; ///< mean of `change` in the 3 x 3 window
};

/// Box filters over rows in ascending order, separable: each row is summed along x once and kept while windows need it.
/// One object serves one thread.
class LocalStatisticsRows {
public:
  /// @param window side of the box: odd, at most 2 kPlaneBorder + 1
  LocalStatisticsRows(uint32_t width, uint32_t window);

  /// @param first the first row that at() will be asked for
  void begin(const FrameSamples& samples, int first);

  /// Statistics of row y; call for first, first + 1, ... The result lives until the next call.
  const LocalStatistics& at(const FrameSamples& samples, int y);

private:
  void add_row(const FrameSamples& samples, int y);
  float* ring_row(int quantity, int y);

  int width_, radius_;
  std::vector<float> ring_;    // [quantity][row modulo window][x]
  std::vector<float> scratch_; // squares of a row and its border
  LocalStatistics result_;
};

} // namespace packtrace
