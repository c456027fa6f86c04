#include "pbrt_import/files/image_summarizer.h"

#include <string>
#include <utility>

#include "pbrt_import/base/error.h"

namespace packtrace {

void add_problem(ImageSummary& summary, uint64_t pixels, std::string_view of_one, std::string_view of_more) {
  if (pixels == 0) return;
  const std::string subject = pixels == 1 ? "1 pixel " : std::to_string(pixels) + " pixels ";
  summary.problems.push_back(subject + std::string(pixels == 1 ? of_one : of_more));
}

ImageSummarizer::ImageSummarizer(uint32_t width, uint32_t height, ImageWants wants)
    : width_(width), want_mask_(wants.mask), want_colours_(wants.colours) {
  summary_.width = width;
  summary_.height = height;
  want_colours_ = want_colours_ && uint64_t{width} * height <= kMaxTextureTexels;
  if (want_colours_) summary_.rgb.assign(static_cast<size_t>(width) * height * 3, 0);
  if (want_mask_) summary_.nonzero.assign(static_cast<size_t>(AlphaMask::row_words(width)) * height, 0);
}

ImageSummary ImageSummarizer::finish() {
  summary_.average = Vec3(total_ / (static_cast<double>(summary_.width) * summary_.height));
  add_problem(summary_, not_finite_pixels_, "is not finite; it counts as black", "are not finite; they count as black");
  add_problem(summary_, negative_pixels_, "has a negative value, which counts as 0",
              "have negative values, which count as 0");
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
                        (wants.mask ? AlphaMask::row_words(static_cast<uint32_t>(width)) * height * 4 : 0);
  memory.cover(working_bytes + kept, "decoding its " + size + " pixels");
}

} // namespace packtrace
