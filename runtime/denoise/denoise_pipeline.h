#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/camera/gbuffer.h"

namespace packtrace {

/// Result of one frame, rows top to bottom, one entry per pixel in every array.
struct DenoisedAo {
  ImageSize size;
  std::vector<float> ao; ///< [0,1], or kInvalidAo at pixels whose camera ray missed
  std::vector<float>
      variance;            ///< variance of the pixel's temporal mean before the filter, AO squared; 0 without history
  std::vector<float> tspp; ///< temporal samples per pixel: frames of accumulated history; 0 without history
};

/// Where a pixel's history comes from.
enum class HistorySource : uint8_t {
  kMotion, ///< from where the previous frame saw the same surface point (GBuffer::motion_px)
  /// From the same pixel, whatever its camera ray hits now. For frames of a still view whose camera rays are jittered
  /// within their pixels: the history then converges to the mean over the pixel's area.
  kPixel,
  /// From the same pixel: the G-buffer is that of the frame before and nothing moves. The denoiser takes it on trust
  /// and reads no guides, which takes time with kMotion. Without a frame before, the same as kMotion.
  kUnchanged,
};

/// Time of a pass on a GPU.
struct DenoiserPassTime {
  const char* name;
  double ms;
  uint32_t bytes_per_pixel; ///< that the pass must read and write, whatever the picture
};

/// One of the denoisers behind AoDenoiser, which checks the arguments and describes the functions.
class DenoisePipeline {
public:
  virtual ~DenoisePipeline() = default;
  /// Called before the first frame and where the size changes. Discards the history.
  virtual void resize(ImageSize size) = 0;
  /// Sizes are those of the last resize(), and not empty.
  virtual void add_frame(const GBuffer& gbuffer, const AoFrame& ao, HistorySource source) = 0;
  /// @param with_variance whether DenoisedAo::variance is read; if false, it may be empty or that of another frame
  virtual const DenoisedAo& denoise(bool with_variance) = 0;
  virtual std::vector<std::byte> save() const = 0;
  virtual void restore(ImageSize size, std::span<const std::byte> bytes) = 0;
  virtual void reset() = 0;
  virtual size_t state_bytes() const = 0;
  virtual void free_spare_memory() {}
  virtual std::vector<DenoiserPassTime> pass_times() const { return {}; }
};

} // namespace packtrace
