#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "pbrt_import/scene/math.h"
#include "runtime/image/image.h"

namespace packtrace {

/// What stands in a preview where nothing was hit.
struct Background {
  enum class Kind { kColor, kSky, kTransparent };
  Kind kind = Kind::kColor;
  Vec3 color{0}; ///< of kColor: display values in [0,1], with the sRGB transfer
};

/// A light grey with a trace of blue: told apart from unoccluded surfaces, which are white, and from all occluded ones,
/// which are neutral.
inline constexpr Vec3 kDefaultBackground{0.79f, 0.82f, 0.86f};

/// The names that parse_background() knows, "sky" and "transparent" among them.
const std::vector<std::string>& background_names();

/// A name of background_names(), or rrggbb or rgb in hexadecimal digits, with "#" or without, as a shell takes an
/// unquoted "#" for a comment. Case does not matter. Throws Error(kUsage) for others.
Background parse_background(std::string_view text);

/// A preview in front of a background. Partial coverage mixes linear light.
/// @param preview three channels of display values
/// @param coverage of each pixel, in [0,1]
/// @return display values of three channels; of four for kTransparent, the last being the coverage
Image over_background(const Image& preview, std::span<const float> coverage, const Background& background);

} // namespace packtrace
