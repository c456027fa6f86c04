#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "compress/format/layout/baked_format.h"
#include "pbrt_import/scene/albedo_texture.h"

namespace packtrace {

/// How the texels of a colour texture are stored. The numbers are on disk.
enum class TextureCodec : uint32_t {
  kRgb8,     ///< 24 bits a texel
  kPalette8, ///< 8 bits: an index into 256 colours
  kR2G4B2,   ///< 8 bits: 4 x 16 x 4 levels between two key colours
  kBc1       ///< 4 bits: blocks of 4 x 4 texels as BC1 (DXT1) has them
};
inline constexpr std::array<std::string_view, 4> kTextureCodecNames{"rgb8", "palette8", "r2g4b2", "bc1"};
std::optional<TextureCodec> find_texture_codec(std::string_view name);

/// sRGB-encoded.
using Rgb8 = std::array<uint8_t, 3>;

inline constexpr uint32_t kMaxTextureSide = 1u << 24;
inline constexpr size_t kPaletteBytes = 3 * 256, kR2G4B2KeyBytes = 2 * 3, kBc1BlockBytes = 8;

/// Bytes of a texture's data. Sides are at most kMaxTextureSide.
uint64_t texture_bytes(TextureCodec codec, uint32_t width, uint32_t height);

/// What is wrong with a record, or nothing. Any data is valid data of every codec.
/// @param bytes of the section of texture bytes
std::optional<std::string_view> find_texture_fault(const baked::TextureRecord& record, uint64_t bytes);

/// Colours that a BC1 block chooses from. The first endpoint is the larger number, or the last colour is black.
std::array<Rgb8, 4> bc1_colours(uint16_t endpoint0, uint16_t endpoint1);

/// A texture that does not own its data; what both AlbedoTexture and the baked file can be looked at through.
struct TextureView {
  uint32_t width = 0;
  uint32_t height = 0;
  WrapMode wrap = WrapMode::kRepeat;
  Vec2 uv_scale{1.0f};
  Vec2 uv_offset{0.0f};
  TextureCodec codec = TextureCodec::kRgb8;
  std::span<const uint8_t> data; ///< texture_bytes() of them

  /// x < width, y < height, rows from the top.
  Rgb8 texel(uint32_t x, uint32_t y) const;

  /// Bilinear, in linear light, linear sRGB primaries. Black outside where the wrap mode says so; coordinates that are
  /// not finite, or so large that texels are not distinguishable, give the first texel.
  Vec3 sample(Vec2 uv) const;
};

TextureView view(const AlbedoTexture& texture);

} // namespace packtrace
