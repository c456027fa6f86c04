#pragma once

#include <memory>
#include <span>

#include "pbrt_import/base/isa.h"
#include "runtime/denoise/flux_config.h"
#include "runtime/denoise/history.h"
#include "runtime/denoise/reprojection.h"

namespace packtrace {

/// What a frame adds to the history.
struct HistoryInput {
  const Guides& guides;
  std::span<const float> ao;          ///< one value per pixel, rows top to bottom
  std::span<const float> max_history; ///< AoFrame::max_history
  const MotionFrame* motion;          ///< null: the history stays in its pixels
  bool correct;                       ///< corrects the slow history where the fast one shows a change
  float longest;                      ///< of the slow history, in frames
};

/// Updates the history by a frame's samples, with all steps together over strips of rows, so that intermediate rows
/// stay in the cache. Results depend neither on the number of threads nor on the instruction set.
///
/// Accumulation: x += (sample - x) / min(n + 1, longest), where n is the history length; longest is fast_frames for the
/// fast history. Negative and non-finite samples are ignored, and the pixel keeps its history. Samples above 1 are
/// clamped to 1.
///
/// Correction of the slow history where the fast history shows that the scene has changed: the change at a pixel is the
/// mean over its window of the fast minus the slow history. Both histories contain the same spatial edges, so the
/// expected change is 0 while the scene stands still, however much AO varies in space. (Comparing a pixel with its
/// neighbours' mean does not have this property.) Where the change exceeds change_gamma standard errors +
/// change_tolerance, the excess is added to the mean and the sample count is reduced, so that detail recovers within a
/// few frames. A 3 x 3 window is tested in the same way to find changes in areas too small for the wide window; the
/// larger of the two corrections is applied.
class HistoryUpdate {
public:
  HistoryUpdate(const FluxConfig& config, Isa isa);
  ~HistoryUpdate();

  /// @param trends how fast the means of stratified samples converge: trend.h
  void run(const HistoryInput& input, History& history, Plane<uint32_t>& trends);

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace packtrace
