#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "compress/format/layout/baked_format.h"
#include "pbrt_import/scene/albedo_texture.h"

namespace packtrace {

/// Encoding of a colour texture. Files store these numbers.
enum class TextureCodec : uint32_t {
  kRgb8,     ///< 24 bits per texel
  kPalette8, ///< 8 bits per texel: index into 256 colours
  kR2G4B2,   ///< 8 bits per texel: 4 x 16 x 4 levels between two key colours
  kBc1       ///< 4 bits per texel: blocks of 4 x 4 texels in BC1 (DXT1) format
};
inline constexpr std::array<std::string_view, 4> kTextureCodecNames{"rgb8", "palette8", "r2g4b2", "bc1"};
std::optional<TextureCodec> find_texture_codec(std::string_view name);

/// sRGB-encoded colour.
using Rgb8 = std::array<uint8_t, 3>;

inline constexpr uint32_t kMaxTextureSide = 1u << 24;
inline constexpr size_t kPaletteBytes = 3 * 256, kR2G4B2KeyBytes = 2 * 3, kBc1BlockBytes = 8;

/// Size of a texture's data in bytes. Sides are at most kMaxTextureSide.
uint64_t texture_bytes(TextureCodec codec, uint32_t width, uint32_t height);

/// Returns the fault of a texture record, or nullopt. Any data are valid for every codec.
/// @param bytes size of the section of texture bytes
std::optional<std::string_view> find_texture_fault(const baked::TextureRecord& record, uint64_t bytes);

/// Returns the four colours of a BC1 block. If endpoint0 <= endpoint1, the last colour is black.
std::array<Rgb8, 4> bc1_colours(uint16_t endpoint0, uint16_t endpoint1);

/// A texture that does not own its data. It gives the same access to an AlbedoTexture and to a texture of a baked file.
struct TextureView {
  uint32_t width = 0;
  uint32_t height = 0;
  WrapMode wrap = WrapMode::kRepeat;
  Vec2 uv_scale{1.0f};
  Vec2 uv_offset{0.0f};
  TextureCodec codec = TextureCodec::kRgb8;
  std::span<const uint8_t> data; ///< texture_bytes() bytes

  /// Texel of column x < width and row y < height; rows count from the top.
  Rgb8 texel(uint32_t x, uint32_t y) const;

  /// Bilinear lookup in linear light; linear sRGB. With black wrapping, texels outside are black. Coordinates that are
  /// not finite, or too large to distinguish texels, look up the first texel.
  Vec3 sample(Vec2 uv) const;
};

TextureView view(const AlbedoTexture& texture);

} // namespace packtrace
