#pragma once

#include <array>
#include <cstdint>

#include "runtime/denoise/flux_config.h"
#include "runtime/denoise/guides.h"
#include "runtime/denoise/kernels/filter_rows.h"

namespace packtrace {

/// Guide weights of all pairs of neighbours that the filter compares. They last until a guide changes.
class PairGuides {
public:
  static constexpr std::array<int, 3> kSteps = {1, 2, 4}; ///< pixels apart

  /// Memory of three planes of 4 bytes a pixel, whose pixels, but not their borders, are overwritten.
  struct Memory {
    Plane<float>& first;
    Plane<uint32_t>& second;
    Plane<float>& third;
  };

  /// @param memory of the size of the guides; it must last as long as the weights
  void compute(const Guides& guides, const FluxConfig& config, const FilterKernels& kernels, const Memory& memory);

  /// The weights of the pairs kSteps[step] pixels apart that begin in row y, from pixel x on.
  PairRow row(size_t step, int x, int y) const {
    const uint8_t* first = begin_[step] + y * stride_ + x;
    return {first, first + width_, first + 2 * width_, first + 3 * width_};
  }
  /// From a row to the next one.
  ptrdiff_t stride() const { return stride_; }

private:
  std::array<uint8_t*, kSteps.size()> begin_{}; ///< row 0; each row has the weights of the four pairs in turn
  ptrdiff_t stride_ = 0, width_ = 0;
};

} // namespace packtrace
