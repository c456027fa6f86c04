#include "runtime/image/image.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace packtrace {

float srgb_from_linear(float linear) {
  return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1.0f / 2.4f) - 0.055f;
}

float linear_from_srgb(float encoded) {
  return encoded <= 0.04045f ? encoded / 12.92f : std::pow((encoded + 0.055f) / 1.055f, 2.4f);
}

Image keep_channels(const Image& image, uint32_t channels) {
  assert(channels >= 1 && channels <= image.channels);
  Image kept(image.size, channels);
  for (size_t i = 0; i < image.size.pixels(); ++i)
    std::copy_n(image.data.begin() + static_cast<ptrdiff_t>(i * image.channels), channels,
                kept.data.begin() + static_cast<ptrdiff_t>(i * channels));
  return kept;
}

Image grey_to_rgb(const Image& image) {
  assert(image.channels == 1);
  Image rgb(image.size, 3);
  for (size_t i = 0; i < image.data.size(); ++i)
    std::fill_n(rgb.data.begin() + static_cast<ptrdiff_t>(3 * i), 3, image.data[i]);
  return rgb;
}

} // namespace packtrace
