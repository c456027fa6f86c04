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

  void resize(ImageSize size);
  void compute(const Guides& guides, const FluxConfig& config, const FilterKernels& kernels);

  /// The weights of the pairs kSteps[step] pixels apart that begin in row y, from pixel x on.
  PairRow row(size_t step, int x, int y) const {
    const Step& s = steps_[step];
    return {s[0].row(y) + x, s[1].row(y) + x, s[2].row(y) + x, s[3].row(y) + x};
  }
  /// From a row to the next one.
  ptrdiff_t stride() const { return steps_[0][0].stride(); }
  size_t bytes() const { return kSteps.size() * kPairOffsets.size() * steps_[0][0].bytes(); }

private:
  using Step = std::array<Plane<uint8_t>, kPairOffsets.size()>;
  std::array<Step, kSteps.size()> steps_;
};

} // namespace packtrace
