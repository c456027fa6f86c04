#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "pbrt_import/scene/math.h"
#include "runtime/image/image.h"

namespace packtrace {

/// A colour scale for a false-colour picture.
struct Legend {
  std::string title;                                ///< quantity and unit, such as "depth, world units"
  std::function<Vec3(float)> color;                 ///< display colour along the bar, t in [0,1]
  std::vector<std::pair<float, std::string>> ticks; ///< position on the bar in [0,1], ascending, and its label
};

/// Appends a strip below the picture with the title, a colour bar and its labels. A title or label that does not fit is
/// left out. The picture's own pixels do not change. Text grows with the picture's width.
/// @param picture three or four channels of display values
Image with_legend(const Image& picture, const Legend& legend);

/// Height in pixels of the strip that with_legend() adds to a picture of this width.
uint32_t legend_height(uint32_t width);

/// A colour scale of discrete steps: bands of equal width, labelled in their middle.
/// @param bands colour and label, at least one
Legend banded_legend(std::string title, const std::vector<std::pair<Vec3, std::string>>& bands);

/// Five equidistant labels from t = 0 to t = 1, with three significant digits.
/// @param value_at value at position t in [0,1]
std::vector<std::pair<float, std::string>> even_ticks(const std::function<double(float)>& value_at);

} // namespace packtrace
