#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace packtrace {

/// One channel as the header of an EXR file lists it.
struct ExrChannelHeader {
  std::string name;
  uint32_t sample_bytes = 0;               ///< 2 or 4
  uint32_t x_sampling = 1, y_sampling = 1; ///< pixels per sample, at least 1
};

/// What must be known of an EXR file before a library opens it.
struct ExrHeader {
  int32_t min_x = 0, min_y = 0, max_x = -1, max_y = -1; ///< data window, both ends included; not checked
  std::vector<ExrChannelHeader> channels;               ///< as stored; may be empty
  uint32_t block_lines = 1;                             ///< scan lines that are compressed together; of tiles 0
  uint32_t tile_width = 0, tile_height = 0;             ///< pixels, 0 where there are no tiles

  /// Pixels; 0 where the window is turned round.
  uint64_t width() const { return max_x < min_x ? 0 : static_cast<uint64_t>(int64_t{max_x} - min_x + 1); }
  uint64_t height() const { return max_y < min_y ? 0 : static_cast<uint64_t>(int64_t{max_y} - min_y + 1); }
  /// Of all channels, taken as if none were subsampled.
  uint64_t pixel_bytes() const;
  /// What OpenEXR unpacks at a time: a block of scan lines, or a whole row of tiles. UINT64_MAX where that overflows.
  uint64_t block_bytes() const;
};

/// Why EXR files of this kind are not read (deep, in several parts, of another version), "" for the others and what is
/// no EXR file.
/// @param bytes the whole file
std::string_view unsupported_exr_kind(std::span<const std::byte> bytes);

/// Steps through the header of a single-part EXR file without believing it. OpenEXR allocates what attributes claim
/// before it reads them, and takes their sizes from some types and from the file for others; here both must agree, and
/// everything claimed, the table of offsets behind the header included, must lie within the file.
/// @param bytes the whole file
/// @param complaint what the message of an Error begins with, such as "a.exr: damaged EXR file: "
/// Throws Error(kInput) otherwise.
/// Source: OpenEXR file layout, https://openexr.com/en/latest/OpenEXRFileLayout.html
ExrHeader scan_exr_header(std::span<const std::byte> bytes, const std::string& complaint);

} // namespace packtrace
