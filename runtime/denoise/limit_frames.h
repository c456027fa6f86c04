#pragma once

#include <algorithm>
#include <span>

#include "runtime/denoise/plane.h"

namespace packtrace {

/// Shortens the histories of a row.
/// @param frames lengths; `limited` may be the same row
inline void limit_row(size_t width, const float* longest, const float* frames, float* limited) {
  for (size_t x = 0; x < width; ++x) limited[x] = std::min(frames[x], longest[x]);
}

/// Shortens the history of each pixel.
/// @param longest history lengths in frames, one per pixel, rows top to bottom
/// @param frames history lengths
inline void limit_frames(std::span<const float> longest, ImageSize size, Plane<float>& frames) {
  for_row_blocks(size.height, [&](int first, int last) {
    for (int y = first; y < last; ++y)
      limit_row(size.width, &longest[static_cast<size_t>(y) * size.width], frames.row(y), frames.row(y));
  });
}

} // namespace packtrace
