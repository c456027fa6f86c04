#include "pbrt_import/files/image_summarizer.h"

#include <string>
#include <utility>

#include "pbrt_import/base/error.h"
#include "pbrt_import/scene/shading.h"

namespace packtrace {

void fail_image(const std::string& why) { throw Error(ErrorKind::kInput, why); }

void add_problem(ImageSummary& summary, uint64_t pixels, std::string_view of_one, std::string_view of_more) {
  if (pixels == 0) return;
  const std::string subject = pixels == 1 ? "1 pixel " : std::to_string(pixels) + " pixels ";
  summary.problems.push_back(subject + std::string(pixels == 1 ? of_one : of_more));
}

ImageSummarizer::ImageSummarizer(uint32_t width, uint32_t height, ImageWants wants)
    : width_(width), want_mask_(wants.mask), want_colours_(wants.colours), want_radiance_(wants.radiance),
      grey_cutoff_(wants.grey_cutoff) {
  summary_.width = width;
  summary_.height = height;
  want_colours_ = want_colours_ && uint64_t{width} * height <= kMaxTextureTexels;
  if (want_colours_) summary_.rgb.assign(static_cast<size_t>(width) * height * 3, 0);
  if (want_mask_) summary_.nonzero.assign(static_cast<size_t>(AlphaMask::row_words(width)) * height, 0);
  if (!want_radiance_) return;
  summary_.map_width = std::min(width, kMaxMapWidth), summary_.map_height = std::min(height, kMaxMapHeight);
  summary_.radiance.assign(size_t{summary_.map_width} * summary_.map_height, Vec3(0.0f));
}

/// Divides the sums by the number of pixels in them.
void ImageSummarizer::average_map() {
  const auto count = [](uint32_t i, uint32_t from, uint32_t to) { // pixels x with x * to / from == i
    const auto first = [&](uint64_t n) { return (n * from + to - 1) / to; };
    return first(uint64_t{i} + 1) - first(i);
  };
  for (uint32_t y = 0; y < summary_.map_height; ++y)
    for (uint32_t x = 0; x < summary_.map_width; ++x) {
      const uint64_t pixels =
          count(x, summary_.width, summary_.map_width) * count(y, summary_.height, summary_.map_height);
      summary_.radiance[size_t{y} * summary_.map_width + x] /= static_cast<float>(pixels);
    }
}

ImageSummary ImageSummarizer::finish() {
  if (want_radiance_) average_map();
  summary_.average = Vec3(total_ / (static_cast<double>(summary_.width) * summary_.height));
  add_problem(summary_, not_finite_pixels_, "is not finite; it counts as black", "are not finite; they count as black");
  add_problem(summary_, negative_pixels_, "has a negative value, which counts as 0",
              "have negative values, which count as 0");
  add_problem(summary_, too_bright_pixels_, "is brighter than 1e25, which counts as 1e25",
              "are brighter than 1e25, which counts as 1e25");
  return std::move(summary_);
}

void ClaimedImageSize::check(uint64_t stored_bytes, uint64_t working_bytes, ImageWants wants,
                             MemoryReservation& memory) const {
  const auto fail = [](const std::string& why) { throw Error(ErrorKind::kInput, why); };
  const std::string size = std::to_string(width) + " x " + std::to_string(height);
  if (width == 0 || height == 0) fail("the image has no pixels");
  constexpr uint64_t kMaxSide = 1u << 24;
  if (width > kMaxSide || height > kMaxSide) fail("an image of " + size + " pixels is not read");
  const uint64_t pixels = width * height;
  if (pixels / pixels_per_byte > stored_bytes)
    fail("damaged image: its " + std::to_string(stored_bytes) + " bytes cannot hold the " + size + " pixels it claims");
  const uint64_t kept = (wants.colours && pixels <= kMaxTextureTexels ? 3 * pixels : 0) +
                        (wants.mask ? AlphaMask::row_words(static_cast<uint32_t>(width)) * height * 4 : 0) +
                        (wants.radiance ? std::min<uint64_t>(width, kMaxMapWidth) *
                                              std::min<uint64_t>(height, kMaxMapHeight) * sizeof(Vec3)
                                        : 0);
  memory.cover(working_bytes + kept, "decoding its " + size + " pixels");
}

} // namespace packtrace
