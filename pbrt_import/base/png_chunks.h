#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace packtrace {

/// Content of the header chunk of a PNG file.
struct PngHeader {
  uint32_t width = 0, height = 0; ///< pixels, at least 1
  uint32_t bits_per_sample = 0;   ///< 1, 2, 4, 8 or 16; bits per index for palette images
  uint32_t channels = 0;          ///< stored channels: 1 for palette images
  bool palette = false;
  bool interlaced = false;
  uint64_t wrong_checksums = 0; ///< number of chunks with a wrong checksum
};

enum class PngChecksums : uint8_t { kCount, kVerify }; ///< kVerify: a wrong checksum is an error

/// Checks all chunks of a PNG file, so that a decoder can trust them before it allocates: each chunk lies within the
/// file, the header comes first, there are image data, and their decompressed size is close to the size that the header
/// implies.
/// @param bytes the whole file; data after the end chunk are ignored
/// @param complaint prefix of the messages of errors, such as "a.png: damaged PNG file: "
/// Throws Error(kInput) otherwise. Needs memory for one small buffer only.
/// Source: ISO/IEC 15948:2003 (PNG), sections 5 and 11.2.
PngHeader check_png_chunks(std::span<const std::byte> bytes, PngChecksums checksums, const std::string& complaint);

/// A palette image split into palette and indices, because decoders do not check that indices are in the palette.
struct PngPalette {
  std::vector<std::array<uint8_t, 3>> colours; ///< in the order of the file
  std::vector<uint8_t> alphas;                 ///< of the first colours; all others are opaque
  std::vector<std::byte> indices_as_grey;      ///< a greyscale PNG file of at most 8 bits whose values are the indices
  uint32_t grey_step = 1;                      ///< difference between the 8-bit grey values of consecutive indices
};

/// Extracts the palette of a PNG file.
/// @param bytes a file that passed check_png_chunks() and has a palette
/// Throws Error(kInput) if the palette is missing or malformed.
PngPalette png_palette(std::span<const std::byte> bytes, const std::string& complaint);

} // namespace packtrace
