#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace packtrace {

/// A channel as listed in the header of an EXR file.
struct ExrChannelHeader {
  std::string name;
  uint32_t sample_bytes = 0;               ///< 2 or 4
  uint32_t x_sampling = 1, y_sampling = 1; ///< pixels per sample, at least 1
};

/// The header data of an EXR file that must be checked before a library opens the file.
struct ExrHeader {
  int32_t min_x = 0, min_y = 0, max_x = -1, max_y = -1; ///< data window, both ends inclusive; not validated
  std::vector<ExrChannelHeader> channels;               ///< in the order of the file; may be empty
  uint32_t block_lines = 1;                             ///< scan lines per compressed block; 0 for tiled files
  uint32_t tile_width = 0, tile_height = 0;             ///< pixels; 0 for files without tiles

  /// Width and height in pixels; 0 if the window is inverted.
  uint64_t width() const { return max_x < min_x ? 0 : static_cast<uint64_t>(int64_t{max_x} - min_x + 1); }
  uint64_t height() const { return max_y < min_y ? 0 : static_cast<uint64_t>(int64_t{max_y} - min_y + 1); }
  /// Bytes per pixel of all channels, ignoring subsampling.
  uint64_t pixel_bytes() const;
  /// Bytes that OpenEXR decompresses at once: a block of scan lines, or a whole row of tiles. UINT64_MAX on overflow.
  uint64_t block_bytes() const;
};

/// Reason why an EXR file is not supported (deep, multi-part or of another version); "" for supported files and other
/// formats.
/// @param bytes the whole file
std::string_view unsupported_exr_kind(std::span<const std::byte> bytes);

/// Reads the header of a single-part EXR file without trusting it. OpenEXR allocates what attributes claim before it
/// reads them. For some types it uses the size that the type implies, for others the size in the file. This function
/// requires that both agree, and that all claimed data, including the offset table behind the header, lie within the
/// file.
/// @param bytes the whole file
/// @param complaint prefix of the messages of errors, such as "a.exr: damaged EXR file: "
/// Throws Error(kInput) otherwise.
/// Source: OpenEXR file layout, https://openexr.com/en/latest/OpenEXRFileLayout.html
ExrHeader scan_exr_header(std::span<const std::byte> bytes, const std::string& complaint);

} // namespace packtrace
