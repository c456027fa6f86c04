#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "pbrt_import/scene/alpha_mask.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Colours of a material over texture coordinates. Row 0 is the top row of the image, as in AlphaMask.
struct AlbedoTexture {
  std::string name;    ///< name of the Texture directive, for display
  uint32_t width = 0;  ///< texels
  uint32_t height = 0; ///< texels
  WrapMode wrap = WrapMode::kRepeat;
  Vec2 uv_scale{1.0f}; ///< st = uv * uv_scale + uv_offset
  Vec2 uv_offset{0.0f};
  std::vector<uint8_t> rgb; ///< 3 x width x height bytes, sRGB-encoded
};

/// Linear value of an sRGB-encoded value in [0, 1].
/// Source: IEC 61966-2-1.
inline float linear_of_srgb(double v) {
  return static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
}

/// Table of the linear values of all sRGB-encoded bytes.
inline const std::array<float, 256>& linear_of_srgb8() {
  static const std::array<float, 256> kTable = [] {
    std::array<float, 256> table{};
    for (size_t i = 0; i < table.size(); ++i) table[i] = linear_of_srgb(static_cast<double>(i) / 255.0);
    return table;
  }();
  return kTable;
}

/// The sRGB-encoded byte nearest to a linear value; clamped to [0, 1], NaN gives 0.
inline uint8_t srgb8_of_linear(float linear) {
  static const std::array<float, 255> kBorders = [] { // linear values between consecutive bytes
    std::array<float, 255> borders{};
    for (size_t i = 0; i < borders.size(); ++i) borders[i] = linear_of_srgb((static_cast<double>(i) + 0.5) / 255.0);
    return borders;
  }();
  return static_cast<uint8_t>(
      std::upper_bound(kBorders.begin(), kBorders.end(), linear, [](float v, float border) { return !(v >= border); }) -
      kBorders.begin());
}

} // namespace packtrace
