#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace packtrace {

/// What a TGA file's header says of its pixels.
struct TgaHeader {
  uint32_t width = 0, height = 0; ///< pixels, at least 1
  uint32_t pixel_bits = 0;        ///< 8, 15, 16, 24 or 32; of an index where there is a palette: 8 or 16
  bool palette = false, grey = false, run_lengths = false;
  bool from_the_top = false, from_the_right = false;
  uint32_t palette_first = 0, palette_entries = 0, palette_bits = 0; ///< 0 entries: no palette in the file
  size_t palette_offset = 0;                                         ///< bytes; the pixels follow the palette
};

/// None if bytes are no TGA file that is read: colours, grey or palette, run-length encoded or not.
std::optional<TgaHeader> parse_tga_header(std::span<const std::byte> bytes);

/// The decoded pixels of a TGA file, and what is wrong with it.
struct TgaPixels {
  std::vector<uint8_t> rgb;         ///< rows from the top, 3 bytes a pixel
  uint64_t surplus_pixels = 0;      ///< that the last run has beyond the image's end
  uint64_t pixels_out_of_range = 0; ///< with an index that the palette does not have: black
};

/// Throws Error(kInput), message without a file name, if bytes end before the last pixel. The caller checks the size.
/// Source: Truevision, TGA File Format Specification, version 2.0, 1991.
TgaPixels decode_tga(std::span<const std::byte> bytes, const TgaHeader& header);

} // namespace packtrace
