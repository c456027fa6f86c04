#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "pbrt_import/base/memory_budget.h"
#include "runtime/image/image.h"

namespace packtrace {

/// An image together with where it came from.
struct LoadedImage {
  Image image;
  std::string layer;        ///< the EXR layer taken; empty for PNG and for plain EXR channels
  bool alpha = false;       ///< the last channel is opacity, not colour
  MemoryReservation memory; ///< of the image and of what decoding it took
};

/// Reads a PNG (to linear) or EXR file; its first bytes tell which.
/// @param layer EXR layer, see choose_layer(); PNG files have none, so only "" and "ao" are accepted for them
/// @param budget pays for the file's bytes and the samples before they are allocated
/// Throws Error(kInput) for other formats and like decode_png() and decode_exr(); MemoryError where the budget does not
/// suffice.
LoadedImage read_image(const std::filesystem::path& path, std::string_view layer = {},
                       const MemoryBudget& budget = MemoryBudget());

} // namespace packtrace
