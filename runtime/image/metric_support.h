#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "runtime/image/metrics.h"

namespace packtrace {

/// One value per pixel, rows top to bottom.
using ImagePlane = std::vector<double>;

/// Calls row(y) for each row from several threads.
void for_each_row(ImageSize size, const std::function<void(uint32_t y)>& row);

/// Throws Error(kInput) unless the two images can be compared (metrics.h).
void check_comparable(const Image& test, const Image& reference, std::span<const uint8_t> valid);

/// Sum of value(pixel index) over counted pixels, divided by their number; adds up row by row, so that the result does
/// not depend on the number of threads. At least one pixel must count.
double mean_over(ImageSize size, std::span<const uint8_t> valid, const std::function<double(size_t)>& value);

/// A map with value(pixel index) at counted pixels and 0 elsewhere.
Image map_over(ImageSize size, std::span<const uint8_t> valid, const std::function<double(size_t)>& value);

/// result(x,y) = sum over k in [-r,r] of kernel[k + r] * in(clamp(x + k), y) for a kernel of 2r + 1 weights.
ImagePlane filter_rows(const ImagePlane& in, ImageSize size, std::span<const double> kernel);
/// The same along y.
ImagePlane filter_columns(const ImagePlane& in, ImageSize size, std::span<const double> kernel);

inline bool counts(std::span<const uint8_t> valid, size_t pixel) { return valid.empty() || valid[pixel] != 0; }

} // namespace packtrace
