#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "pbrt_import/scene/math.h"
#include "pbrt_import/base/memory_budget.h"

namespace packtrace {

/// What the importer keeps of a texture image.
struct ImageSummary {
  uint32_t width = 0;                ///< pixels
  uint32_t height = 0;               ///< pixels
  Vec3 average{0.0f};                ///< linear RGB; values that are negative or not finite count as 0
  std::vector<std::string> problems; ///< what is wrong with the file, though it can be read
  std::vector<uint8_t> rgb;          ///< AlbedoTexture's layout, clamped to [0, 1]; empty if not wanted or too large
  std::vector<uint32_t> nonzero;     ///< AlphaMask's layout: bit set where luminance is not 0
};

/// What to keep of an image besides its size and average.
struct ImageWants {
  bool mask = false;    ///< ImageSummary::nonzero
  bool colours = false; ///< ImageSummary::rgb
};

/// Images of more texels are known by their average only.
inline constexpr uint64_t kMostTextureTexels = uint64_t{1} << 26;

/// Reads PNG, TGA, OpenEXR, PFM, which are pbrt's formats, and HDR; alpha channels are ignored, as pbrt
/// does. Other formats are refused by name: pbrt does not read them either.
/// @param bytes the whole file
/// @param decode_srgb whether integer formats are sRGB-encoded
/// @param memory grows by what this takes, before it is taken
/// Throws Error(kInput), message without a file name, if it is none of these or damaged, or has more than 2^24 pixels
/// along a side; MemoryError.
ImageSummary read_image(std::span<const std::byte> bytes, bool decode_srgb, ImageWants wants,
                        MemoryReservation& memory);
inline ImageSummary read_image(std::span<const std::byte> bytes, bool decode_srgb, bool want_mask, uint64_t max_bytes) {
  MemoryReservation memory{MemoryBudget(max_bytes)};
  return read_image(bytes, decode_srgb, ImageWants{want_mask, false}, memory);
}

/// Memory that a summary's arrays take.
inline uint64_t bytes_of(const ImageSummary& summary) {
  return summary.rgb.size() + summary.nonzero.size() * sizeof(uint32_t);
}

} // namespace packtrace
