#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "runtime/denoise/denoiser.h"
#include "tests/benchmarks/denoiser_sequence.h"

namespace packtrace {

/// An image against the truth, over the pixels that have one.
struct ImageScore {
  double psnr = 0, ssim = 0, flip = 0;
  double bias = 0; ///< mean difference
};

/// What a denoiser made of a sequence.
struct SequenceScore {
  std::string scene, motion, denoiser;
  std::map<uint32_t, ImageScore> images; ///< by number of frames
  /// Ghosts by number of frames since the occluder is gone: the fraction that remains of the difference between the
  /// truths with and without it. Over surfaces that were visible before; noise does not change it.
  std::map<uint32_t, double> ghosts;
  /// Mean change of a pixel's value since the frame before, following its motion, over the second half of the frames
  /// that move, or of all. Only pixels that show the same surface, and of which the truth stays the same.
  double flicker = 0;
  double truth_flicker = 0; ///< of the ground truth, between the first two frames of a view that moves; 0: not known
  double add_frame_ms = 0, denoise_ms = 0; ///< a frame
};

/// Frame counts since an occluder is gone for which ghosts are measured.
inline constexpr uint32_t kGhostFrames[] = {4, 8, 16, 32};

/// The denoiser of a name: ours; history, which is ours without filter; reference; none for off, the mean of the
/// samples since something moved.
/// @param config settings of ours and reference
/// Throws Error(kUsage) for other names.
std::optional<DenoiserConfig> preset_of(const std::string& name, DenoiserConfig config);

/// Runs the denoiser of a name over a sequence.
SequenceScore score(const DenoiserSequence& sequence, const std::string& denoiser, const DenoiserConfig& config);

/// One line per image, ghost and flicker, with a header: scene, motion, denoiser, quantity, frames, value.
std::string csv_of(const std::vector<SequenceScore>& scores);
/// A table for documentation: one line per sequence and denoiser.
std::string markdown_of(const std::vector<SequenceScore>& scores);

} // namespace packtrace
