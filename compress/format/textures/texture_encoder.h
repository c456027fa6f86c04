#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "compress/format/textures/texture_codec.h"
#include "pbrt_import/scene/albedo_texture.h"

namespace packtrace {

/// A texture in one codec's form.
struct EncodedTexture {
  TextureCodec codec = TextureCodec::kRgb8;
  std::vector<uint8_t> data; ///< texture_bytes()
  double psnr_db = 0.0;      ///< of the sRGB-encoded values; infinite where nothing was lost
};

/// The texture in that codec; without one, the smallest whose PSNR is at least min_psnr_db, which rgb8 always is. Of
/// equal size, the better one. The result depends on the arguments only.
EncodedTexture encode_texture(const AlbedoTexture& texture, std::optional<TextureCodec> codec, double min_psnr_db);

/// 10 log10(255^2 / mean squared error) over all channels of all texels.
double texture_psnr_db(const AlbedoTexture& texture, const TextureView& coded);

std::vector<uint8_t> encode_palette8(const AlbedoTexture& texture);
std::vector<uint8_t> encode_r2g4b2(const AlbedoTexture& texture);
std::vector<uint8_t> encode_bc1(const AlbedoTexture& texture);

} // namespace packtrace
