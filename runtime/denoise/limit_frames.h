#pragma once

#include <algorithm>
#include <span>

#include "runtime/denoise/plane.h"

namespace packtrace {

/// Shortens the history of each pixel.
/// @param longest history lengths in frames, one per pixel, rows top to bottom
/// @param frames history lengths
inline void limit_frames(std::span<const float> longest, ImageSize size, Plane<float>& frames) {
  for_row_blocks(size.height, [&](int first, int last) {
    for (int y = first; y < last; ++y) {
      const float* limit = &longest[static_cast<size_t>(y) * size.width];
      float* row = frames.row(y);
      for (int x = 0; x < static_cast<int>(size.width); ++x) row[x] = std::min(row[x], limit[x]);
    }
  });
}

} // namespace packtrace
