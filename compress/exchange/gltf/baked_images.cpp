#include "compress/exchange/gltf/baked_images.h"

#include <algorithm>

namespace packtrace {

RgbaImage image_of(const AlphaMaskView& bits, const TextureView& colours) {
  RgbaImage image{std::max(bits.width, colours.width), std::max(bits.height, colours.height), {}};
  image.pixels.reserve(size_t{image.width} * image.height * 4);
  const auto scaled = [](uint32_t at, uint32_t from, uint32_t to) {
    return static_cast<uint32_t>((uint64_t{at} * 2 + 1) * to / (uint64_t{from} * 2));
  };
  for (uint32_t y = 0; y < image.height; ++y)
    for (uint32_t x = 0; x < image.width; ++x) {
      Rgb8 colour{255, 255, 255};
      if (colours.width > 0)
        colour = colours.texel(scaled(x, image.width, colours.width), scaled(y, image.height, colours.height));
      uint8_t alpha = 255;
      if (bits.width > 0) {
        const uint32_t column = scaled(x, image.width, bits.width), row = scaled(y, image.height, bits.height);
        const size_t word = size_t{row} * AlphaMask::row_words(bits.width) + column / 32;
        alpha = (bits.words[word] >> (column % 32)) & 1u ? 255 : 0;
      }
      image.pixels.insert(image.pixels.end(), {colour[0], colour[1], colour[2], alpha});
    }
  return image;
}

} // namespace packtrace
