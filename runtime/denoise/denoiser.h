#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "runtime/camera/gbuffer.h"
#include "runtime/denoise/denoise_pipeline.h"
#include "runtime/denoise/denoiser_config.h"
#include "runtime/gpu/gpu_config.h"

namespace packtrace {

/// Spatio-temporal denoiser for ambient occlusion (docs/denoiser.md). It accumulates samples along surface motion and
/// removes the remaining noise by flows between similar pixels. The accumulated history itself is never blurred, so a
/// still image converges to the mean of its samples.
///
/// Results are bit-identical for any number of threads. Use one object per view, from one thread at a time.
class AoDenoiser {
public:
  /// @param device runs the denoiser there, where its history then stays; null: on the CPU
  /// Throws Error (kUsage) if the configuration is out of range; with a device Error (kUnsupported) for the preset
  /// `reference`, and as opening a device does.
  explicit AoDenoiser(const DenoiserConfig& config = {}, const GpuConfig* device = nullptr);

  /// Denoises the next frame. A change of the image size discards the history, as reset() does. Negative and non-finite
  /// values of `ao` mean that the pixel has no sample in this frame. A pixel with a non-finite depth counts as a miss;
  /// a pixel with a non-finite normal gets no history and hardly any filter. Other pixels are not affected. Throws
  /// Error (kUsage) if the two sizes differ, an array does not have one entry per pixel, or AoFrame::samples is out of
  /// range.
  /// @return the result, valid until the next call
  const DenoisedAo& next_frame(const GBuffer& gbuffer, const AoFrame& ao) {
    add_frame(gbuffer, ao);
    return denoise();
  }

  /// The first half of next_frame(): adds a frame to the history. A still view of which only the last frame is shown
  /// needs denoise() only once.
  /// @param gbuffer with kPixel: the mean surface of each pixel in all frames so far
  /// @param ao samples at the surfaces that this frame's camera rays hit
  void add_frame(const GBuffer& gbuffer, const AoFrame& ao, HistorySource source = HistorySource::kMotion);

  /// The second half of next_frame(): filters a copy of the history. Without a frame, all pixels are misses.
  /// @param with_variance whether DenoisedAo::variance is read; if false, it may be empty or that of another frame
  /// @return the result, valid until the next call
  const DenoisedAo& denoise(bool with_variance = true);

  /// Returns the history and its guides as bytes, for restore(); empty without history.
  std::vector<std::byte> save() const;
  /// Continues where an object with the same configuration was saved. Throws Error (kInput) if the bytes do not belong
  /// to images of this size.
  void restore(ImageSize size, std::span<const std::byte> bytes);

  /// Discards all history. Call it at camera cuts.
  void reset();

  /// Frees memory that no result depends on. The next frame that moves, or denoise(), allocates it again.
  void free_spare_memory();

  /// Bytes of memory that are held between frames, without the result and without each thread's rows.
  size_t state_bytes() const;

  /// Passes of the last add_frame() and the last denoise() on a GPU; empty on CPUs.
  std::vector<DenoiserPassTime> pass_times() const;

private:
  std::unique_ptr<DenoisePipeline> pipeline_;
  ImageSize size_; ///< of the pipeline
};

} // namespace packtrace
