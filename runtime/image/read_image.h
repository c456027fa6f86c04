#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "pbrt_import/base/memory_budget.h"
#include "runtime/image/image.h"

namespace packtrace {

/// An image and what was read from the file.
struct LoadedImage {
  Image image;
  std::string layer;        ///< name of the EXR layer that was read; empty for PNG files and for plain EXR channels
  bool alpha = false;       ///< whether the last channel is alpha
  MemoryReservation memory; ///< for the image and for decoding it
};

/// Reads a PNG file (converted to linear values) or an EXR file. The format is detected from the first bytes.
/// @param layer EXR layer, see choose_layer(). PNG files have no layers and accept only "" and "ao".
/// @param budget reserves the file's bytes and the samples before they are allocated
/// Throws Error(kInput) for other formats, and like decode_png() and decode_exr(); MemoryError if the budget does not
/// suffice.
LoadedImage read_image(const std::filesystem::path& path, std::string_view layer = {},
                       const MemoryBudget& budget = MemoryBudget());

} // namespace packtrace
