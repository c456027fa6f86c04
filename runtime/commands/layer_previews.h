#pragma once

#include <optional>
#include <string>

#include "runtime/image/background.h"
#include "runtime/image/image.h"
#include "runtime/render/renderer.h"

namespace packtrace {

/// How layers are shown in .png files.
struct PreviewStyle {
  std::optional<Background> background; ///< none: a sky behind albedo and shaded, kDefaultBackground behind the rest
  bool legend = true;                   ///< a strip below the layers whose colours stand for numbers
};

/// A layer as a picture of display values, three channels, or four in front of a transparent background.
/// @param aov one of aov_names()
Image layer_preview(const RenderedImage& image, const std::string& aov, const PreviewStyle& style);

} // namespace packtrace
