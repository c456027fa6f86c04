#pragma once

#include <string>

namespace packtrace {

/// Text of compress/exchange/vertex16/vertex16.glsl.
std::string vertex16_glsl();
/// Text of compress/exchange/vertex16/vertex16_decode.h. The functions are the GLSL ones, letter for letter, over GLM's types.
std::string vertex16_cpp();

} // namespace packtrace
