#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include "runtime/image/image.h"

namespace packtrace {

/// What the numbers of a PNG file mean.
enum class PngTransfer : uint8_t {
  kSrgb, ///< linear colours, stored with the sRGB transfer; alpha is stored as it is
  kRaw,  ///< values in [0,1] stored as they are: data, or colours that have the transfer already (false_color.h)
};

/// An 8-bit PNG file of an image with 1 (grey), 2 (grey, alpha), 3 or 4 channels. Samples are clamped to [0,1] and
/// rounded to nearest; NaN becomes 0. The bytes depend on nothing but the arguments.
/// Throws Error(kUsage) where the image is empty, has other channel counts or is too large for the format's writer.
std::vector<std::byte> encode_png(const Image& image, PngTransfer transfer);

/// encode_png() to a file. Throws Error(kIo) where writing fails.
void write_png(const std::filesystem::path& path, const Image& image, PngTransfer transfer);

/// Decodes any PNG (1 to 16 bits, palette, interlaced) to floats in [0,1]; the channels are those of the file, with
/// palettes as colours. Ancillary chunks (gamma, profiles) are ignored: values are taken to be sRGB or raw as told.
/// Every chunk's checksum is verified, so truncated and altered files are noticed.
/// @param name for messages, usually the path
/// Throws Error(kInput) for damaged files and those larger than kMaxImageSide or kMaxImageSamples.
Image decode_png(std::span<const std::byte> bytes, std::string_view name, PngTransfer transfer = PngTransfer::kSrgb);

/// decode_png() of a file. Throws Error(kInput) also where it cannot be read.
Image read_png(const std::filesystem::path& path, PngTransfer transfer = PngTransfer::kSrgb);

} // namespace packtrace
