#include "runtime/image/metric_support.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "pbrt_import/base/error.h"

namespace packtrace {

namespace {

std::string shape(const Image& image) {
  return std::to_string(image.size.width) + " x " + std::to_string(image.size.height) + " pixels with " +
         std::to_string(image.channels) + " channels";
}

void check_finite(const Image& image, std::span<const uint8_t> valid) {
  const size_t channels = image.channels;
  for (size_t i = 0; i < image.data.size(); ++i)
    if (!std::isfinite(image.data[i]) && counts(valid, i / channels)) {
      const size_t pixel = i / channels;
      throw Error(ErrorKind::kInput, "the image has a value that is not finite at x " +
                                         std::to_string(pixel % image.size.width) + ", y " +
                                         std::to_string(pixel / image.size.width));
    }
}

} // namespace

void for_each_row(ImageSize size, const std::function<void(uint32_t y)>& row) {
  tbb::parallel_for(tbb::blocked_range<uint32_t>(0, size.height, 4), [&](const tbb::blocked_range<uint32_t>& rows) {
    for (uint32_t y = rows.begin(); y != rows.end(); ++y) row(y);
  });
}

void check_comparable(const Image& test, const Image& reference, std::span<const uint8_t> valid) {
  if (test.size != reference.size || test.channels != reference.channels)
    throw Error(ErrorKind::kInput, "images differ in shape: " + shape(test) + " and " + shape(reference));
  if (!valid.empty() && valid.size() != test.size.pixels())
    throw Error(ErrorKind::kInput, "the mask does not fit images of " + shape(test));
  const bool any =
      valid.empty() ? !test.data.empty() : std::any_of(valid.begin(), valid.end(), [](uint8_t v) { return v; });
  if (!any) throw Error(ErrorKind::kInput, "there is no pixel to compare");
  check_finite(test, valid);
  check_finite(reference, valid);
}

double mean_over(ImageSize size, std::span<const uint8_t> valid, const std::function<double(size_t)>& value) {
  std::vector<double> sums(size.height, 0.0);
  std::vector<uint64_t> numbers(size.height, 0);
  for_each_row(size, [&](uint32_t y) {
    for (size_t i = size_t{y} * size.width; i < (size_t{y} + 1) * size.width; ++i)
      if (counts(valid, i)) sums[y] += value(i), ++numbers[y];
  });
  double sum = 0.0;
  uint64_t number = 0;
  for (uint32_t y = 0; y < size.height; ++y) sum += sums[y], number += numbers[y];
  return sum / static_cast<double>(number);
}

Image map_over(ImageSize size, std::span<const uint8_t> valid, const std::function<double(size_t)>& value) {
  Image map(size, 1);
  for_each_row(size, [&](uint32_t y) {
    for (size_t i = size_t{y} * size.width; i < (size_t{y} + 1) * size.width; ++i)
      if (counts(valid, i)) map.data[i] = static_cast<float>(value(i));
  });
  return map;
}

ImagePlane filter_rows(const ImagePlane& in, ImageSize size, std::span<const double> kernel) {
  ImagePlane out(in.size());
  const size_t radius = kernel.size() / 2, width = size.width;
  for_each_row(size, [&](uint32_t y) {
    const auto row = in.begin() + static_cast<ptrdiff_t>(y * width);
    ImagePlane padded(width + 2 * radius);
    std::fill_n(padded.begin(), radius, row[0]);
    std::copy_n(row, width, padded.begin() + static_cast<ptrdiff_t>(radius));
    std::fill_n(padded.end() - static_cast<ptrdiff_t>(radius), radius, row[static_cast<ptrdiff_t>(width) - 1]);
    double* target = out.data() + y * width;
    for (size_t k = 0; k < kernel.size(); ++k)
      for (size_t x = 0; x < width; ++x) target[x] += kernel[k] * padded[x + k];
  });
  return out;
}

ImagePlane filter_columns(const ImagePlane& in, ImageSize size, std::span<const double> kernel) {
  ImagePlane out(in.size());
  const ptrdiff_t radius = static_cast<ptrdiff_t>(kernel.size() / 2), last = ptrdiff_t{size.height} - 1;
  for_each_row(size, [&](uint32_t y) {
    double* target = out.data() + size_t{y} * size.width;
    for (size_t k = 0; k < kernel.size(); ++k) {
      const ptrdiff_t source_y = std::clamp<ptrdiff_t>(ptrdiff_t{y} + static_cast<ptrdiff_t>(k) - radius, 0, last);
      const double* source = in.data() + source_y * ptrdiff_t{size.width};
      for (size_t x = 0; x < size.width; ++x) target[x] += kernel[k] * source[x];
    }
  });
  return out;
}

} // namespace packtrace
