#pragma once

#include <cstdint>
#include <span>

#include "assets/generator/buffered_file.h"

namespace packtrace::scenegen {

/// Writes a PNG of 8 bits per channel, the same bytes on every machine.
/// @param channels 1 (grey) or 3 (sRGB)
/// @param texels rows from top to bottom; width * height * channels values
void write_png(BufferedFile& file, uint32_t width, uint32_t height, uint32_t channels, std::span<const uint8_t> texels);

} // namespace packtrace::scenegen
