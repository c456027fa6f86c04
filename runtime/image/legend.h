#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "pbrt_import/scene/math.h"
#include "runtime/image/image.h"

namespace packtrace {

/// What the colours of a picture mean.
struct Legend {
  std::string title;                                ///< "depth", with the unit
  std::function<Vec3(float)> color;                 ///< display colour along the bar, t in [0,1]
  std::vector<std::pair<float, std::string>> ticks; ///< where a label belongs on the bar, and the label; ordered
};

/// The picture with a strip below it: a bar of colours, its labels and the title, as far as they fit. The pixels of the
/// picture stay as they are. Letters are as tall as the picture's width allows.
/// @param picture three or four channels of display values
Image with_legend(const Image& picture, const Legend& legend);

/// Height of the strip that with_legend() adds to a picture of this width, pixels.
uint32_t legend_height(uint32_t width);

/// A colour scale of discrete steps: bands of equal width, each labelled in its middle.
Legend banded_legend(std::string title, const std::vector<std::pair<Vec3, std::string>>& bands);

/// Up to five labels at equal distances, of values between those of the bar's ends.
/// @param value_at of t in [0,1]
std::vector<std::pair<float, std::string>> even_ticks(const std::function<double(float)>& value_at);

} // namespace packtrace
