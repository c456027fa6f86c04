#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "runtime/image/image.h"

namespace packtrace {

/// Header of a YUV4MPEG2 stream of 8-bit 4:4:4 frames, for video encoders.
/// @param fps_numerator, fps_denominator frames per second as a fraction
std::vector<std::byte> y4m_header(ImageSize size, uint32_t fps_numerator, uint32_t fps_denominator);

/// A frame of the stream: the picture in limited-range ITU-R BT.601 Y'CbCr.
/// @param picture display values in [0, 1], three channels
std::vector<std::byte> y4m_frame(const Image& picture);

} // namespace packtrace
