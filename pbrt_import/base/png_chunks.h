#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace packtrace {

/// What the header chunk of a PNG file says.
struct PngHeader {
  uint32_t width = 0, height = 0; ///< pixels, at least 1
  uint32_t bits_per_sample = 0;   ///< 1, 2, 4, 8 or 16; of an index where there is a palette
  uint32_t channels = 0;          ///< as stored: 1 where there is a palette
  bool palette = false;
  bool interlaced = false;
  uint64_t wrong_checksums = 0; ///< chunks
};

enum class PngChecksums : uint8_t { kCount, kVerify }; ///< verify: a wrong one is an error

/// Walks all chunks of a PNG file, so that a decoder can rely on what they say before it allocates: each lies within
/// the file, the header comes first, there are image data, and these unpack to about as much as the header asks for.
/// @param bytes the whole file; what lies behind the end chunk is ignored
/// @param complaint what the message of an Error begins with, such as "a.png: damaged PNG file: "
/// Throws Error(kInput) otherwise. Takes memory for one small buffer.
/// Source: ISO/IEC 15948:2003 (PNG), sections 5 and 11.2.
PngHeader check_png_chunks(std::span<const std::byte> bytes, PngChecksums checksums, const std::string& complaint);

/// A palette image taken apart: decoders look colours up without asking whether the palette has them.
struct PngPalette {
  std::vector<std::array<uint8_t, 3>> colours; ///< as stored
  std::vector<std::byte> indices_as_grey;      ///< a PNG file of 8 bits or less whose grey values are the indices
  uint32_t grey_step = 1;                      ///< between the grey values of two indices once decoded to 8 bits
};

/// @param bytes a file that passed check_png_chunks() and has a palette
/// Throws Error(kInput) if the palette is missing or malformed.
PngPalette png_palette(std::span<const std::byte> bytes, const std::string& complaint);

} // namespace packtrace
