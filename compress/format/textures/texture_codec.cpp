#include "compress/format/textures/texture_codec.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace packtrace {
namespace {

/// Expands channels of 5, 6 and 5 bits, red highest, to 8 bits by repeating their bits.
Rgb8 from_565(uint16_t c) {
  const uint32_t r = c >> 11, g = (c >> 5) & 63u, b = c & 31u;
  return {static_cast<uint8_t>((r << 3) | (r >> 2)), static_cast<uint8_t>((g << 2) | (g >> 4)),
          static_cast<uint8_t>((b << 3) | (b >> 2))};
}

Rgb8 decode_r2g4b2(std::span<const uint8_t> keys, uint8_t code) {
  const uint32_t bits = code;
  const std::array<uint32_t, 3> levels{bits >> 6u, (bits >> 2u) & 15u, bits & 3u}, most{3, 15, 3};
  Rgb8 colour;
  for (size_t c = 0; c < 3; ++c)
    colour[c] =
        static_cast<uint8_t>((keys[c] * (most[c] - levels[c]) + keys[3 + c] * levels[c] + most[c] / 2) / most[c]);
  return colour;
}

Rgb8 decode_bc1(std::span<const uint8_t> block, uint32_t x, uint32_t y) {
  const auto endpoint = [&](size_t at) { return static_cast<uint16_t>(block[at] | (block[at + 1] << 8)); };
  const uint32_t index = (block[4 + y] >> (2 * x)) & 3u;
  return bc1_colours(endpoint(0), endpoint(2))[index];
}

/// Wraps a texel coordinate; nothing if it lies outside a black-wrapped texture.
std::optional<uint32_t> wrapped(int64_t i, uint32_t size, WrapMode wrap) {
  const int64_t n = size;
  switch (wrap) {
  case WrapMode::kRepeat:
    return static_cast<uint32_t>(((i % n) + n) % n);
  case WrapMode::kClamp:
    return static_cast<uint32_t>(std::clamp<int64_t>(i, 0, n - 1));
  case WrapMode::kBlack:
    break;
  }
  if (i < 0 || i >= n) return std::nullopt;
  return static_cast<uint32_t>(i);
}

} // namespace

std::optional<TextureCodec> find_texture_codec(std::string_view name) {
  const auto found = std::find(kTextureCodecNames.begin(), kTextureCodecNames.end(), name);
  if (found == kTextureCodecNames.end()) return std::nullopt;
  return static_cast<TextureCodec>(found - kTextureCodecNames.begin());
}

uint64_t texture_bytes(TextureCodec codec, uint32_t width, uint32_t height) {
  const uint64_t texels = uint64_t{width} * height;
  switch (codec) {
  case TextureCodec::kRgb8:
    return 3 * texels;
  case TextureCodec::kPalette8:
    return kPaletteBytes + texels;
  case TextureCodec::kR2G4B2:
    return kR2G4B2KeyBytes + texels;
  case TextureCodec::kBc1:
    break;
  }
  return (uint64_t{width} + 3) / 4 * ((uint64_t{height} + 3) / 4) * kBc1BlockBytes;
}

std::optional<std::string_view> find_texture_fault(const baked::TextureRecord& t, uint64_t bytes) {
  if (t.width == 0 || t.height == 0 || t.width > kMaxTextureSide || t.height > kMaxTextureSide) return "size";
  if (t.wrap > 2 || t.codec >= kTextureCodecNames.size() || t.reserved != 0) return "codec or wrap mode";
  if (t.first_byte > bytes ||
      texture_bytes(static_cast<TextureCodec>(t.codec), t.width, t.height) > bytes - t.first_byte)
    return "extent";
  for (const float f : {t.uv_scale[0], t.uv_scale[1], t.uv_offset[0], t.uv_offset[1]})
    if (!std::isfinite(f)) return "transform";
  if (!(t.psnr_db >= 0.0f)) return "error";
  return std::nullopt;
}

std::array<Rgb8, 4> bc1_colours(uint16_t endpoint0, uint16_t endpoint1) {
  std::array<Rgb8, 4> colours{from_565(endpoint0), from_565(endpoint1), {}, {}};
  for (size_t c = 0; c < 3; ++c) {
    const uint32_t a = colours[0][c], b = colours[1][c];
    colours[2][c] = static_cast<uint8_t>(endpoint0 > endpoint1 ? (2 * a + b + 1) / 3 : (a + b + 1) / 2);
    colours[3][c] = static_cast<uint8_t>(endpoint0 > endpoint1 ? (a + 2 * b + 1) / 3 : 0);
  }
  return colours;
}

Rgb8 TextureView::texel(uint32_t x, uint32_t y) const {
  const size_t number = static_cast<size_t>(y) * width + x;
  switch (codec) {
  case TextureCodec::kRgb8:
    return {data[3 * number], data[3 * number + 1], data[3 * number + 2]};
  case TextureCodec::kPalette8: {
    const size_t entry = size_t{3} * data[kPaletteBytes + number];
    return {data[entry], data[entry + 1], data[entry + 2]};
  }
  case TextureCodec::kR2G4B2:
    return decode_r2g4b2(data, data[kR2G4B2KeyBytes + number]);
  case TextureCodec::kBc1:
    break;
  }
  const size_t block = static_cast<size_t>(y / 4) * ((size_t{width} + 3) / 4) + x / 4;
  return decode_bc1(data.subspan(block * kBc1BlockBytes, kBc1BlockBytes), x % 4, y % 4);
}

Vec3 TextureView::sample(Vec2 uv) const {
  const double s = static_cast<double>(uv.x) * uv_scale.x + uv_offset.x;
  const double t = static_cast<double>(uv.y) * uv_scale.y + uv_offset.y;
  // Texel centres are at (i + 1/2) / size. t points up, rows run down.
  double x = s * width - 0.5, y = (1.0 - t) * height - 0.5;
  constexpr double kLimit = 9.0e15; // neighbouring texels beyond this are equal in double
  if (!(std::abs(x) < kLimit && std::abs(y) < kLimit)) x = y = 0.0;
  const auto x0 = static_cast<int64_t>(std::floor(x)), y0 = static_cast<int64_t>(std::floor(y));
  const auto right = static_cast<float>(x - static_cast<double>(x0)),
             down = static_cast<float>(y - static_cast<double>(y0));
  const std::array<float, 256>& linear = linear_of_srgb8();
  Vec3 sum(0.0f);
  for (int corner = 0; corner < 4; ++corner) {
    const auto column = wrapped(x0 + (corner & 1), width, wrap), row = wrapped(y0 + (corner >> 1), height, wrap);
    if (!column || !row) continue;
    const Rgb8 colour = texel(*column, *row);
    const float weight = ((corner & 1) != 0 ? right : 1.0f - right) * ((corner >> 1) != 0 ? down : 1.0f - down);
    sum += weight * Vec3(linear[colour[0]], linear[colour[1]], linear[colour[2]]);
  }
  return sum;
}

TextureView view(const AlbedoTexture& texture) {
  return {texture.width,     texture.height,      texture.wrap, texture.uv_scale,
          texture.uv_offset, TextureCodec::kRgb8, texture.rgb};
}

} // namespace packtrace
