#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "pbrt_import/base/memory_budget.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

/// The data that the importer keeps of a texture image.
struct ImageSummary {
  uint32_t width = 0;                ///< pixels
  uint32_t height = 0;               ///< pixels
  Vec3 average{0.0f};                ///< linear RGB; negative and non-finite values count as 0
  std::vector<std::string> problems; ///< damage that did not prevent reading
  uint64_t transparent = 0;          ///< pixels whose alpha is below 1 at 8 bits; 0 if not wanted
  std::vector<uint8_t> rgb;          ///< layout of AlbedoTexture, clamped to [0, 1]; empty if not wanted or too large
  std::vector<uint32_t> nonzero;     ///< layout of AlphaMask; a bit is set if any channel is not 0, or see alpha_cutoff
  uint32_t map_width = 0;            ///< of `radiance`: that of the image, at most kMaxMapWidth
  uint32_t map_height = 0;
  std::vector<Vec3> radiance; ///< linear RGB, row 0 on top, averaged to the map's size; empty if not wanted
};

/// Selects optional data of an image, besides its size and average.
struct ImageWants {
  bool mask = false;     ///< fill ImageSummary::nonzero
  bool colours = false;  ///< fill ImageSummary::rgb
  bool radiance = false; ///< fill ImageSummary::radiance
  /// Set: bits of the mask are set where the image's alpha, in [0, 1], is at least this; everywhere without alpha.
  std::optional<float> alpha_cutoff{};
  /// Set: bits of the mask are set where the largest of the linear channels is at least this.
  std::optional<float> grey_cutoff{};
  bool alpha = false; ///< fill ImageSummary::transparent
};

/// Only the average is kept of images with more texels.
inline constexpr uint64_t kMaxTextureTexels = uint64_t{1} << 26;

/// Reads the formats of pbrt, which are PNG, TGA, OpenEXR and PFM, and also HDR, JPEG and WebP. Alpha channels are
/// ignored, as in pbrt, unless ImageWants::alpha_cutoff is set, which applies to PNG and WebP, or ImageWants::alpha.
/// Other formats are rejected with their name.
/// @param bytes the whole file
/// @param decode_srgb whether values of the integer formats are sRGB-encoded
/// @param memory grows by the memory that the summary and decoding need, before it is allocated
/// Throws Error(kInput), with a message without file name, if the format is unknown, the file is damaged or a side is
/// longer than 2^24 pixels; throws MemoryError.
ImageSummary read_image(std::span<const std::byte> bytes, bool decode_srgb, ImageWants wants,
                        MemoryReservation& memory);
inline ImageSummary read_image(std::span<const std::byte> bytes, bool decode_srgb, bool want_mask, uint64_t max_bytes) {
  MemoryReservation memory{MemoryBudget(max_bytes)};
  return read_image(bytes, decode_srgb, ImageWants{want_mask, false, false}, memory);
}

/// Memory of a summary's arrays in bytes.
inline uint64_t bytes_of(const ImageSummary& summary) {
  return summary.rgb.size() + summary.nonzero.size() * sizeof(uint32_t) + summary.radiance.size() * sizeof(Vec3);
}

} // namespace packtrace
