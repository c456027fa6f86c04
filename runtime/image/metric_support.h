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

/// Throws Error(kInput) unless the two images can be compared as metrics.h requires.
void check_comparable(const Image& test, const Image& reference, std::span<const uint8_t> valid);

/// Mean of value(pixel index) over the counted pixels, of which there must be at least one. Sums are formed per row
/// first, so that the result does not depend on the number of threads.
double mean_over(ImageSize size, std::span<const uint8_t> valid, const std::function<double(size_t)>& value);

/// Returns a one-channel map with value(pixel index) at counted pixels and 0 elsewhere.
Image map_over(ImageSize size, std::span<const uint8_t> valid, const std::function<double(size_t)>& value);

/// result(x,y) = sum over k in [-r,r] of kernel[k + r] * in(clamp(x + k), y) for a kernel of 2r + 1 weights.
ImagePlane filter_rows(const ImagePlane& in, ImageSize size, std::span<const double> kernel);
/// Filters along y in the same way.
ImagePlane filter_columns(const ImagePlane& in, ImageSize size, std::span<const double> kernel);

/// Whether a pixel counts; an empty `valid` means that all pixels count.
inline bool counts(std::span<const uint8_t> valid, size_t pixel) { return valid.empty() || valid[pixel] != 0; }

} // namespace packtrace
