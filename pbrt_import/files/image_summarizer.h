#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pbrt_import/files/image_file.h"
#include "pbrt_import/scene/albedo_texture.h"
#include "pbrt_import/scene/alpha_mask.h"

namespace packtrace {

/// An upper bound for all formats: PNG reaches 8256; DWAB compression of EXR stores chunks in as few as 96 bytes.
inline constexpr uint64_t kMaxPixelsPerByte = 1u << 16;

/// Throws Error(kInput) with a message without file name.
[[noreturn]] void fail_image(const std::string& why);

/// Adds a problem that affects `pixels` pixels, in the singular or the plural; none if the count is 0.
void add_problem(ImageSummary& summary, uint64_t pixels, std::string_view of_one, std::string_view of_more);

/// Accumulates an ImageSummary from pixels that are added in row order, from the top.
class ImageSummarizer {
public:
  ImageSummarizer(uint32_t width, uint32_t height, ImageWants wants);

  /// @param pixel linear RGB; components that are negative or not finite are counted as problems
  void add(uint32_t x, uint32_t y, Vec3 pixel) {
    if (!is_finite(pixel)) {
      ++not_finite_pixels_;
      return;
    }
    const bool nonzero = grey_cutoff_ ? std::max({pixel.x, pixel.y, pixel.z}) >= *grey_cutoff_
                                      : pixel.x != 0.0f || pixel.y != 0.0f || pixel.z != 0.0f;
    if (pixel.x < 0.0f || pixel.y < 0.0f || pixel.z < 0.0f) {
      ++negative_pixels_;
      pixel = glm::max(pixel, Vec3(0.0f));
    }
    row_ += DVec3(pixel);
    if (want_radiance_) {
      constexpr float kBrightest = 1e25f; // sums of a map's pixels stay finite
      too_bright_pixels_ += std::max({pixel.x, pixel.y, pixel.z}) > kBrightest;
      map_at(x, y) += glm::min(pixel, Vec3(kBrightest));
    }
    if (want_colours_)
      for (size_t c = 0; c < 3; ++c)
        summary_.rgb[(static_cast<size_t>(y) * width_ + x) * 3 + c] = srgb8_of_linear(pixel[static_cast<int>(c)]);
    if (want_mask_ && nonzero)
      summary_.nonzero[static_cast<size_t>(y) * AlphaMask::row_words(width_) + x / 32] |= 1u << (x % 32);
  }

  /// Adds a whole row of 8-bit pixels, as add() and end_row() would.
  /// @tparam kChannels 3, or 1 for grey pixels
  /// @param linear linear value of each sample value, not negative; the same for all rows
  template <uint32_t kChannels>
  void add_row(uint32_t y, const uint8_t* pixels, const std::array<float, 256>& linear) {
    double sums[kChannels] = {};
    const uint8_t* sample = pixels;
    for (uint32_t x = 0; x < width_; ++x)
      for (double& sum : sums) sum += double{linear[*sample++]};
    row_ += DVec3(sums[0], sums[kChannels / 2], sums[kChannels - 1]);
    if (want_mask_) set_mask_row<kChannels>(y, pixels, linear);
    if (want_radiance_)
      for (uint32_t x = 0; x < width_; ++x) {
        const uint8_t* const p = pixels + size_t{x} * kChannels;
        map_at(x, y) += Vec3(linear[p[0]], linear[p[kChannels / 2]], linear[p[kChannels - 1]]);
      }
    if (want_colours_) {
      if (coded_.empty())
        for (const float value : linear) coded_.push_back(srgb8_of_linear(value));
      uint8_t* to = summary_.rgb.data() + static_cast<size_t>(y) * width_ * 3;
      for (uint32_t x = 0; x < width_; ++x)
        for (uint32_t c = 0; c < 3; ++c) *to++ = coded_[pixels[x * kChannels + (kChannels == 1 ? 0 : c)]];
    }
    end_row();
  }

  /// Summing per row keeps the rounding error of the total small.
  void end_row() {
    total_ += row_;
    row_ = DVec3(0.0);
  }

  /// Returns the summary with its average and problems. To be called once, after the last row.
  ImageSummary finish();

private:
  /// The sum of the map's pixel that holds a pixel of the image.
  Vec3& map_at(uint32_t x, uint32_t y) {
    const uint64_t column = uint64_t{x} * summary_.map_width / summary_.width,
                   row = uint64_t{y} * summary_.map_height / summary_.height;
    return summary_.radiance[static_cast<size_t>(row * summary_.map_width + column)];
  }
  void average_map();

  template <uint32_t kChannels>
  void set_mask_row(uint32_t y, const uint8_t* pixels, const std::array<float, 256>& linear) {
    const uint32_t words = AlphaMask::row_words(width_);
    uint32_t* const row = summary_.nonzero.data() + static_cast<size_t>(y) * words;
    for (uint32_t w = 0; w < words; ++w) {
      const uint32_t count = std::min(32u, width_ - 32 * w);
      uint32_t bits = 0;
      for (uint32_t i = 0; i < count; ++i) {
        bool nonzero = false;
        for (uint32_t c = 0; c < kChannels; ++c, ++pixels)
          nonzero |= grey_cutoff_ ? linear[*pixels] >= *grey_cutoff_ : linear[*pixels] != 0.0f;
        bits |= (nonzero ? 1u : 0u) << i;
      }
      row[w] = bits;
    }
  }

  ImageSummary summary_;
  uint64_t not_finite_pixels_ = 0, negative_pixels_ = 0, too_bright_pixels_ = 0;
  uint32_t width_;
  bool want_mask_, want_colours_, want_radiance_;
  std::optional<float> grey_cutoff_;
  std::vector<uint8_t> coded_; ///< sRGB value of each sample value of add_row()
  DVec3 row_{0.0}, total_{0.0};
};

/// Image size as claimed by a file header, checked before memory is allocated.
struct ClaimedImageSize {
  uint64_t width = 0, height = 0;
  uint64_t pixels_per_byte = kMaxPixelsPerByte; ///< upper bound of the format's compression

  /// Throws Error(kInput) if the size is 0, too large, or larger than the file can hold.
  /// @param stored_bytes size of the file
  /// @param working_bytes memory that decoding takes in addition to the kept data
  /// @param memory grows by both
  void check(uint64_t stored_bytes, uint64_t working_bytes, ImageWants wants, MemoryReservation& memory) const;
};

} // namespace packtrace
