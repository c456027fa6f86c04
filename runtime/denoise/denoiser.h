#pragma once

#include <memory>
#include <vector>

#include "runtime/camera/gbuffer.h"
#include "runtime/denoise/denoiser_config.h"

namespace packtrace {

/// Result of one frame, rows top to bottom, one entry per pixel in every array.
struct DenoisedAo {
  ImageSize size;
  std::vector<float> ao;       ///< [0,1]; kInvalidAo exactly where the G-buffer missed
  std::vector<float> variance; ///< of the pixel's temporal mean, before any blur, AO squared; 0 where nothing is known
  std::vector<float> tspp;     ///< frames of history that stand behind the pixel; 0: none
};

/// Spatio-temporal denoiser of ambient occlusion: accumulates samples along the motion of surfaces and blurs what noise
/// is left, within surfaces (docs/denoiser.md). The accumulated history itself is never blurred, so a still image
/// converges to the mean of its samples.
///
/// Results are the same bits for any number of threads. One object serves one view and one thread at a time.
class AoDenoiser {
public:
  /// Throws Error (kUsage) if the configuration is out of range.
  explicit AoDenoiser(const DenoiserConfig& config = {});
  ~AoDenoiser();
  AoDenoiser(AoDenoiser&&) noexcept;
  AoDenoiser& operator=(AoDenoiser&&) noexcept;

  /// Denoises the next frame. A frame of another size starts anew, as after reset(). Pixels of `ao` that are negative
  /// or not finite have no sample in this frame. Damaged guides (not finite) cost their pixel its history or count as
  /// a miss; they spoil nothing else.
  /// Throws Error (kUsage) if an array that is read does not have size.pixels() entries, or the sizes differ.
  /// @return valid until the next call
  const DenoisedAo& next_frame(const GBuffer& gbuffer, const AoFrame& ao);

  /// Forgets all history: for camera cuts.
  void reset();

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace packtrace
