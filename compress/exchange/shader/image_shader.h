#pragma once

#include <string>

#include "compress/exchange/shader/shader_image.h"
#include "compress/exchange/shader/shader_text.h"

namespace packtrace {

/// A self-contained shader that shows an image centred, as large as it fits, on black: the words as a
/// constant array, their decoder, and linear interpolation between the texels' sRGB-encoded colours.
/// Throws Error(kLimitExceeded) if the arrays have more than config.max_elements elements.
std::string image_shader(const ShaderImage& image, const ShaderConfig& config);

} // namespace packtrace
