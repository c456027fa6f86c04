#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/ao/ao_integrator.h"
#include "runtime/camera/gbuffer.h"

namespace packtrace {

/// Gives twice as many samples to pixels whose surfaces came into view or whose occlusion changed lately, and fewer to
/// the others, so that a frame has as many rays as with the same number of samples for all pixels. The history of a
/// pixel is that of the nearest pixel of the previous frame that shows the same instance at the depth where the surface
/// was.
class AdaptiveRate {
public:
  /// Pixels with a history of fewer frames are young.
  static constexpr uint8_t kYoungFrames = 2;
  /// Samples of young pixels, and the smallest mean of the others, relative to `spp`. Old pixels need their samples
  /// nearly as much: with 4 or 8 times as many for young ones, moving pictures err more than with a uniform rate.
  static constexpr double kYoungRate = 2.0, kMinRate = 0.25;

  /// Forgets all frames.
  void clear() { age_.clear(); }

  /// Plans the next frame.
  /// @param same_pixels each pixel keeps its history, whatever its camera ray hits now: nothing has moved
  /// @param spp mean number of samples per pixel that shows a surface; an upper bound of the frame's mean but for the
  ///        rounding of a dither pattern
  /// @param max_history AoFrame::max_history: surfaces whose occlusion changes count as younger; empty: none does
  /// @return valid until the next call
  SamplePlan next_frame(const GBuffer& gbuffer, bool same_pixels, uint32_t spp,
                        std::span<const float> max_history = {});

  /// Number of frames in which each pixel's surface got samples, up to 255; 0 at misses.
  std::span<const uint8_t> ages() const { return age_; }

  /// Returns what next_frame() needs of the previous ones, for restore().
  std::vector<std::byte> save() const;
  /// Returns false if the bytes do not belong to frames of this size.
  bool restore(ImageSize size, std::span<const std::byte> bytes);

private:
  struct Pixel {
    uint32_t samples = 0; ///< number of samples that the pixel has got, of whatever surface
    uint32_t instance = kNoInstance;
    float view_z = 0.0f;
  };
  void resize(ImageSize size);
  void follow_surfaces(const GBuffer& gbuffer);
  struct Rates {
    double young, old; ///< in units of spp
  };
  Rates rates(const GBuffer& gbuffer) const;

  ImageSize size_;
  uint32_t frame_ = 0;
  std::vector<Pixel> pixels_;
  std::vector<uint8_t> age_, next_age_;
  std::vector<uint32_t> first_;
  std::vector<uint16_t> count_;
};

} // namespace packtrace
