#pragma once

#include <memory>
#include <span>

#include "pbrt_import/base/isa.h"
#include "runtime/denoise/depth_derivatives.h"
#include "runtime/denoise/flux_config.h"
#include "runtime/denoise/guides.h"
#include "runtime/denoise/history.h"
#include "runtime/denoise/kernels/filter_rows.h"

namespace packtrace {

/// What the filter reads of a frame.
struct FilterInput {
  const Guides& guides;
  const DepthDerivatives& derivatives;
  const History& history;
  bool moving; ///< history was resampled, so that samples are not as well stratified as in a still view
};

/// Where the filter writes; one entry per pixel, as in DenoisedAo.
struct FilterOutput {
  std::span<float> ao, variance, tspp;
};

/// The guides of the pixels from (x, y) on.
SurfaceRow surface_at(const FilterInput& input, int x, int y);
/// What the guide weights of pairs (dx, dy) pixels apart tolerate.
GuideTerms guide_terms(const FluxConfig& config, int dx, int dy);

/// Removes noise from a copy of the history: passes of 3 x 3 taps that move AO between pairs of pixels whose surfaces
/// and surroundings agree (docs/denoiser.md). All passes run together over strips of rows, so that intermediate rows
/// stay in the cache. Results depend neither on the number of threads nor on the instruction set.
class AoFilter {
public:
  AoFilter(const FluxConfig& config, Isa isa);
  ~AoFilter();
  AoFilter(AoFilter&&) noexcept;
  AoFilter& operator=(AoFilter&&) noexcept;

  void run(const FilterInput& input, const FilterOutput& output);

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace packtrace
