#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "pbrt_import/scene/math.h"
#include "runtime/image/image.h"

namespace packtrace {

/// Background of a preview, shown where no camera ray hits.
struct Background {
  enum class Kind { kColor, kSky, kTransparent };
  Kind kind = Kind::kColor;
  Vec3 color{0}; ///< for kColor: sRGB-encoded display values in [0,1]
};

/// Light grey with a trace of blue. It differs from unoccluded surfaces, which are white, and from occluded surfaces,
/// which are neutral grey.
inline constexpr Vec3 kDefaultBackground{0.79f, 0.82f, 0.86f};

/// Names that parse_background() accepts, including "sky" and "transparent".
const std::vector<std::string>& background_names();

/// Parses a name from background_names(), or rrggbb or rgb in hexadecimal digits. The "#" is optional, because shells
/// start a comment at an unquoted "#". Case is ignored. Throws Error(kUsage) for any other text.
Background parse_background(std::string_view text);

/// Composites a preview over a background. Colours are mixed in linear light.
/// @param preview three channels of display values
/// @param coverage one value per pixel, in [0,1]
/// @return display values with three channels; for kTransparent four channels, where alpha is the coverage and colours
///         are not premultiplied
Image over_background(Image preview, std::span<const float> coverage, const Background& background);

} // namespace packtrace
