#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace packtrace {

/// Pixel layout according to the header of a TGA file.
struct TgaHeader {
  uint32_t width = 0, height = 0; ///< pixels, at least 1
  uint32_t pixel_bits = 0;        ///< 8, 15, 16, 24 or 32; with a palette, the size of an index: 8 or 16
  bool palette = false, grey = false, run_lengths = false;
  bool alpha = false; ///< colours have alpha, by their size and the image descriptor
  bool from_the_top = false, from_the_right = false;
  uint32_t palette_first = 0, palette_entries = 0, palette_bits = 0; ///< no palette in the file if 0 entries
  size_t palette_offset = 0;                                         ///< in bytes; the pixels follow the palette
};

/// Parses the header. Returns nullopt unless it describes a supported TGA file: true colour, grey or palette,
/// run-length encoded or not.
std::optional<TgaHeader> parse_tga_header(std::span<const std::byte> bytes);

/// The decoded pixels of a TGA file, with counts of damage.
struct TgaPixels {
  std::vector<uint8_t> rgb;         ///< rows from the top, 3 bytes per pixel
  uint64_t surplus_pixels = 0;      ///< pixels of the last run beyond the end of the image
  uint64_t pixels_out_of_range = 0; ///< pixels with an index that the palette lacks, decoded as black
  uint64_t transparent_pixels = 0;  ///< pixels whose alpha is below 1
};

/// Decodes the pixels. The caller checks the image size beforehand. Throws Error(kInput), with a message without file
/// name, if the file ends before the last pixel.
/// Source: Truevision, TGA File Format Specification, version 2.0, 1991.
TgaPixels decode_tga(std::span<const std::byte> bytes, const TgaHeader& header);

} // namespace packtrace
