#pragma once

#include <algorithm>
#include <cstddef>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "pbrt_import/scene/math.h"
#include "runtime/image/image.h"

namespace packtrace {

/// Makes an image of three channels, on all cores.
/// @param color function of a pixel's number, rows top to bottom, that returns its colour as Vec3; called by several
///   threads
template <typename Color>
Image painted(ImageSize size, const Color& color) {
  constexpr size_t kPixels = 4096; // per task
  Image image(size, 3);
  tbb::parallel_for(tbb::blocked_range<size_t>(0, size.pixels(), kPixels), [&](const tbb::blocked_range<size_t>& part) {
    for (size_t i = part.begin(); i < part.end(); ++i) {
      const Vec3 c = color(i);
      std::copy_n(&c.x, 3, image.data.begin() + static_cast<std::ptrdiff_t>(3 * i));
    }
  });
  return image;
}

} // namespace packtrace
