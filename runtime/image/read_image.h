#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "runtime/image/image.h"

namespace packtrace {

/// An image together with where it came from.
struct LoadedImage {
  Image image;
  std::string layer;  ///< the EXR layer taken; empty for PNG and for plain EXR channels
  bool alpha = false; ///< the last channel is opacity, not colour
};

/// Reads a PNG (to linear) or EXR file; its first bytes tell which.
/// @param layer EXR layer, see choose_layer(); PNG files have none, so only "" and "ao" are accepted for them
/// Throws Error(kInput) for other formats and like decode_png() and decode_exr().
LoadedImage read_image(const std::filesystem::path& path, std::string_view layer = {});

} // namespace packtrace
