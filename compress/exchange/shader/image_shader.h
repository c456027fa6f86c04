#pragma once

#include <string>

#include "compress/exchange/shader/shader_image.h"
#include "compress/exchange/shader/shader_text.h"

namespace packtrace {

/// One self-contained shader that shows an image as large as it fits in the middle, black around it: the words as a
/// constant array, their decoder, and linear interpolation between the texels' sRGB-encoded colours.
/// Throws Error(kLimitExceeded) if the arrays have more than config.max_elements elements.
std::string image_shader(const ShaderImage& image, const ShaderConfig& config);

} // namespace packtrace
