#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "runtime/denoise/denoiser.h"

namespace packtrace {

/// Cost of a denoiser for one frame: medians over frames, in milliseconds. CPU times are those of all threads together.
struct DenoiserCost {
  double history_ms = 0, history_cpu = 0; ///< AoDenoiser::add_frame()
  double filter_ms = 0, filter_cpu = 0;   ///< AoDenoiser::denoise()
  /// Reading the G-buffer, the samples and the state once, and writing the result and what changes of the state.
  double floor_ms = 0, floor_cpu = 0;
  double bytes_per_pixel = 0; ///< AoDenoiser::state_bytes()

  double ratio_cpu() const { return (history_cpu + filter_cpu) / floor_cpu; }
};

/// Frames of binary noise in a room of a floor, a wall and a ball, whose camera stands still or moves sideways.
class DenoiserCostMeter {
public:
  /// @param warm_frames frames of history before the first timed one
  DenoiserCostMeter(const DenoiserConfig& config, ImageSize size, bool moving, uint32_t warm_frames);
  ~DenoiserCostMeter();

  /// Times a frame and, in turn with it, the floor. Returns the wall time of the frame in seconds.
  double time_frame();
  /// Of the frames timed so far, at least one.
  DenoiserCost cost() const;

private:
  struct State;
  std::unique_ptr<State> state_;
};

/// A table for documentation: one line per preset, size, and still or moving view.
/// @param presets names and configurations
std::string cost_table(const std::vector<std::pair<std::string, DenoiserConfig>>& presets,
                       const std::vector<ImageSize>& sizes);

} // namespace packtrace
