#pragma once

#include <optional>
#include <string>

#include "runtime/frame/rendered_image.h"
#include "runtime/image/background.h"
#include "runtime/image/image.h"
#include "runtime/image/tone_map.h"

namespace packtrace {

/// How layers are displayed in .png files.
struct PreviewStyle {
  std::optional<Background> background; ///< if not set: sky for albedo and shaded, none for pbr, direct and
                                        ///< specular, kDefaultBackground for other layers
  bool legend = true;                   ///< add a colour scale below layers in false colours
  Exposure exposure{};                  ///< of pbr, direct and specular
};

/// A view that is one number per pixel: "history" and the like; null for other names.
const std::vector<float>* view_of(const RenderedImage& image, const std::string& aov);

/// Returns a picture of a layer in display values: three channels, or four with a transparent background.
/// @param aov one of aov_names()
Image layer_preview(const RenderedImage& image, const std::string& aov, const PreviewStyle& style);

} // namespace packtrace
