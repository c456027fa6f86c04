#include "compress/format/textures/texture_encoder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace packtrace {
namespace {

/// Evenly spaced levels 0..levels between two values, and the nearest level of each value.
struct Ramp {
  uint8_t lo = 0, hi = 0;
  std::array<uint8_t, 256> level{};
};

/// Starts from the extremes and alternates least squares for the ends with nearest levels while the error falls.
/// @param counts number of texels per value of one channel
Ramp fit_ramp(const std::array<uint64_t, 256>& counts, uint32_t levels) {
  size_t first = 0, last = 255;
  while (first < 255 && counts[first] == 0) ++first;
  while (last > first && counts[last] == 0) --last;
  double lo = static_cast<double>(first), hi = static_cast<double>(last);
  Ramp best;
  double least = std::numeric_limits<double>::infinity();
  for (int round = 0; round < 16; ++round) {
    Ramp ramp;
    ramp.lo = static_cast<uint8_t>(std::lrint(std::clamp(lo, 0.0, 255.0)));
    ramp.hi = static_cast<uint8_t>(std::lrint(std::clamp(hi, 0.0, 255.0)));
    double error = 0.0, aa = 0.0, ab = 0.0, bb = 0.0, av = 0.0, bv = 0.0;
    for (size_t v = 0; v < 256; ++v) {
      double nearest = std::numeric_limits<double>::infinity();
      for (uint32_t level = 0; level <= levels; ++level) {
        // Rounds like the decoder.
        const uint32_t decoded = (ramp.lo * (levels - level) + ramp.hi * level + levels / 2) / levels;
        const double d = std::abs(static_cast<double>(v) - decoded);
        if (d < nearest) nearest = d, ramp.level[v] = static_cast<uint8_t>(level);
      }
      const auto count = static_cast<double>(counts[v]);
      const double b = static_cast<double>(ramp.level[v]) / levels, a = 1.0 - b;
      error += count * nearest * nearest;
      aa += count * a * a, ab += count * a * b, bb += count * b * b;
      av += count * a * static_cast<double>(v), bv += count * b * static_cast<double>(v);
    }
    if (!(error < least)) break;
    least = error, best = ramp;
    const double determinant = aa * bb - ab * ab;
    if (!(determinant > 1e-9)) break;
    lo = (av * bb - bv * ab) / determinant, hi = (bv * aa - av * ab) / determinant;
  }
  return best;
}

} // namespace

double texture_psnr_db(const AlbedoTexture& texture, const TextureView& coded) {
  double sum = 0.0;
  const uint8_t* from = texture.rgb.data();
  for (uint32_t y = 0; y < texture.height; ++y) {
    uint64_t row = 0;
    for (uint32_t x = 0; x < texture.width; ++x)
      for (const uint8_t value : coded.texel(x, y)) {
        const int32_t d = int32_t{*from++} - value;
        row += static_cast<uint64_t>(d * d);
      }
    sum += static_cast<double>(row);
  }
  if (sum == 0.0) return std::numeric_limits<double>::infinity();
  return 10.0 * std::log10(255.0 * 255.0 * static_cast<double>(texture.rgb.size()) / sum);
}

std::vector<uint8_t> encode_r2g4b2(const AlbedoTexture& texture) {
  std::array<std::array<uint64_t, 256>, 3> counts{};
  for (size_t i = 0; i < texture.rgb.size(); ++i) ++counts[i % 3][texture.rgb[i]];
  const std::array<Ramp, 3> ramps{fit_ramp(counts[0], 3), fit_ramp(counts[1], 15), fit_ramp(counts[2], 3)};
  std::vector<uint8_t> data;
  data.reserve(kR2G4B2KeyBytes + texture.rgb.size() / 3);
  for (const Ramp& ramp : ramps) data.push_back(ramp.lo);
  for (const Ramp& ramp : ramps) data.push_back(ramp.hi);
  for (size_t i = 0; i < texture.rgb.size(); i += 3)
    data.push_back(static_cast<uint8_t>((ramps[0].level[texture.rgb[i]] << 6) |
                                        (ramps[1].level[texture.rgb[i + 1]] << 2) |
                                        ramps[2].level[texture.rgb[i + 2]]));
  return data;
}

EncodedTexture encode_texture(const AlbedoTexture& texture, std::optional<TextureCodec> codec, double min_psnr_db) {
  const auto encoded = [&](TextureCodec one) {
    EncodedTexture result;
    result.codec = one;
    result.data = one == TextureCodec::kPalette8 ? encode_palette8(texture)
                  : one == TextureCodec::kR2G4B2 ? encode_r2g4b2(texture)
                  : one == TextureCodec::kBc1    ? encode_bc1(texture)
                                                 : texture.rgb;
    TextureView coded = view(texture);
    coded.codec = one, coded.data = result.data;
    result.psnr_db = texture_psnr_db(texture, coded);
    return result;
  };
  if (codec) return encoded(*codec);
  EncodedTexture best = encoded(TextureCodec::kRgb8);
  for (const TextureCodec one : {TextureCodec::kBc1, TextureCodec::kR2G4B2, TextureCodec::kPalette8}) {
    if (texture_bytes(one, texture.width, texture.height) > best.data.size()) continue;
    EncodedTexture candidate = encoded(one);
    const bool smaller = candidate.data.size() < best.data.size();
    if (candidate.psnr_db >= min_psnr_db && (smaller || candidate.psnr_db > best.psnr_db)) best = std::move(candidate);
  }
  return best;
}

} // namespace packtrace
