#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/camera/gbuffer.h"

namespace packtrace {

/// Maximum width and height of images to read or write, in pixels.
inline constexpr uint32_t kMaxImageSide = 65536;
/// Maximum number of samples (pixels times channels) of images to read: 4 GiB of floats.
inline constexpr uint64_t kMaxImageSamples = uint64_t{1} << 30;

/// An image of float samples, rows top to bottom, channels interleaved: data[(y * width + x) * channels + c]. Colours
/// are linear sRGB (Rec. 709 primaries) unless stated otherwise.
struct Image {
  ImageSize size;
  uint32_t channels = 0;
  std::vector<float> data; ///< size.pixels() * channels

  Image() = default;
  /// Creates an image with all samples set to `fill`.
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

/// Copies the first `channels` channels, 1 <= channels <= image.channels; for example to drop alpha.
Image keep_channels(const Image& image, uint32_t channels);

/// Expands a one-channel image to three equal channels.
Image grey_to_rgb(const Image& image);

} // namespace packtrace
