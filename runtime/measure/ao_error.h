#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "runtime/image/image.h"

namespace packtrace {

/// An ambient occlusion image with the pixels that have a value.
struct AoImage {
  Image image;                ///< one channel; 0 where there is no value
  std::vector<uint8_t> valid; ///< per pixel: 1 if its value is valid
};

/// Reads the layer "ao" of an EXR file. Throws like read_exr().
AoImage read_ao(const std::filesystem::path& file);

/// Per pixel: |test - reference| where both have a value, 1 where only one has, else 0. The images have equal sizes.
std::vector<float> error_map(const AoImage& test, const AoImage& reference);

/// Returns an "ao" object of a report (docs/measure.md), without noise_ratio. Metrics are null if no pixel has a value
/// in both images; SSIM also in images smaller than its window. Throws Error(kInput) for images of different sizes.
nlohmann::json ao_error(const AoImage& test, const AoImage& reference);

/// A square of pixels, cut off at the picture's right and bottom.
struct ErrorTile {
  uint32_t x = 0, y = 0, width = 0, height = 0;
  double mae = 0.0, max = 0.0; ///< of the error map
};

/// The tiles with the largest mean error, worst first; at most `count`, and none without an error.
std::vector<ErrorTile> worst_tiles(const std::vector<float>& errors, ImageSize size, uint32_t side, size_t count);

} // namespace packtrace
