#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/camera/gbuffer.h"

namespace packtrace {

/// Largest width and height of an image this program reads or writes, pixels.
inline constexpr uint32_t kMaxImageSide = 65536;
/// Most samples (pixels times channels) of an image this program reads: 4 GiB of floats.
inline constexpr uint64_t kMaxImageSamples = uint64_t{1} << 30;

/// Float samples, rows top to bottom, channels interleaved: data[(y * width + x) * channels + c]. Colours are linear
/// sRGB (Rec. 709 primaries) unless a function says otherwise.
struct Image {
  ImageSize size;
  uint32_t channels = 0;
  std::vector<float> data; ///< size.pixels() * channels

  Image() = default;
  /// All samples set to fill.
  Image(ImageSize image_size, uint32_t channel_count, float fill = 0.0f)
      : size(image_size), channels(channel_count), data(image_size.pixels() * channel_count, fill) {}

  std::span<float> pixel(uint32_t x, uint32_t y) {
    return std::span(data).subspan((size_t{y} * size.width + x) * channels, channels);
  }
  std::span<const float> pixel(uint32_t x, uint32_t y) const {
    return std::span(data).subspan((size_t{y} * size.width + x) * channels, channels);
  }
};

/// The sRGB opto-electronic transfer: linear [0,1] to encoded [0,1]. Source: IEC 61966-2-1:1999, equations for R'sRGB.
float srgb_from_linear(float linear);
/// Inverse of srgb_from_linear().
float linear_from_srgb(float encoded);

/// The first `channels` channels of each pixel, 1 <= channels <= image.channels. Drops alpha, for example.
Image keep_channels(const Image& image, uint32_t channels);

/// The three-channel image whose channels all equal a one-channel image.
Image grey_to_rgb(const Image& image);

} // namespace packtrace
