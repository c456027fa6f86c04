#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace packtrace {

/// An image of 8 bits per channel: red, green, blue, alpha; rows from the top.
struct RgbaImage {
  uint32_t width = 0, height = 0;
  std::vector<uint8_t> pixels; ///< 4 bytes per pixel
};

/// Encodes an image as PNG. Throws Error(kLimitExceeded) beyond 2^29 pixels.
std::vector<std::byte> encode_png(const RgbaImage& image);

/// An image as WebP.
struct WebpImage {
  std::vector<std::byte> bytes;
  double psnr = 0.0; ///< of the colours, dB; infinite if they are exact. Alpha always is.
};

/// Encodes an image as WebP: lossless, or with the lowest quality whose colours reach the PSNR, whichever is smaller.
/// Throws Error(kLimitExceeded) beyond WebP's 16,383 pixels a side.
/// @param min_psnr dB
WebpImage encode_webp(const RgbaImage& image, double min_psnr);

} // namespace packtrace
