#pragma once

#include <memory>
#include <span>

#include "pbrt_import/base/isa.h"
#include "runtime/denoise/flux_config.h"
#include "runtime/denoise/guides.h"
#include "runtime/denoise/history.h"
#include "runtime/denoise/pair_guides.h"

namespace packtrace {

/// What the filter reads of a frame.
struct FilterInput {
  const Guides& guides;
  const PairGuides& pair_guides;
  const History& history;
  const Plane<uint32_t>& trends; ///< trend.h
  bool moving;      ///< history was resampled, so that samples are not as well stratified as in a still view
  bool stratified;  ///< AoFrame::stratified
  uint32_t samples; ///< AoFrame::samples
};

/// Where the filter writes; one entry per pixel, as in DenoisedAo. Without variance it is not written.
struct FilterOutput {
  std::span<float> ao, variance, tspp;
};

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
