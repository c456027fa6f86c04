#pragma once

#include <string>

namespace packtrace {

/// Text of compress/exchange/vertex16/vertex16.glsl.
std::string vertex16_glsl();
/// Text of compress/exchange/vertex16/vertex16_decode.h. Its functions are the GLSL functions, verbatim, with GLM
/// types.
std::string vertex16_cpp();

} // namespace packtrace
