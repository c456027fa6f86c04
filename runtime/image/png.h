#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include "runtime/image/image.h"

namespace packtrace {

/// How the samples of a PNG file are encoded.
enum class PngTransfer : uint8_t {
  kSrgb, ///< images in memory are linear, files have the sRGB transfer; alpha is not converted
  kRaw,  ///< values in [0,1] without conversion: data, or colours that are already sRGB-encoded (false_color.h)
};

/// Encodes an image with 1 (grey), 2 (grey, alpha), 3 or 4 channels as an 8-bit PNG file. Samples are clamped to [0,1]
/// and rounded to nearest; NaN becomes 0. The bytes depend on the arguments only.
/// Throws Error(kUsage) if the image is empty, has another channel count or is too large for the PNG encoder.
std::vector<std::byte> encode_png(const Image& image, PngTransfer transfer);

/// Writes encode_png() to a file. Throws like encode_png(), and Error(kIo) if writing fails.
void write_png(const std::filesystem::path& path, const Image& image, PngTransfer transfer);

/// Decodes any PNG file (1 to 16 bits, palette, interlaced) to floats in [0,1]. The result has the file's channels;
/// palette indices become colours. Chunks for gamma and colour profiles are ignored; `transfer` decides whether values
/// are decoded from sRGB. The checksums of all chunks are verified to detect truncated and altered files.
/// @param name file name for messages, usually the path
/// Throws Error(kInput) for damaged files and images larger than kMaxImageSide or kMaxImageSamples.
Image decode_png(std::span<const std::byte> bytes, std::string_view name, PngTransfer transfer = PngTransfer::kSrgb);

/// Reads and decodes a file. Throws like decode_png(), and Error(kInput) if the file cannot be read.
Image read_png(const std::filesystem::path& path, PngTransfer transfer = PngTransfer::kSrgb);

} // namespace packtrace
