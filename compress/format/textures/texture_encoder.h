#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "compress/format/textures/texture_codec.h"
#include "pbrt_import/scene/albedo_texture.h"

namespace packtrace {

/// A texture encoded with one codec.
struct EncodedTexture {
  TextureCodec codec = TextureCodec::kRgb8;
  std::vector<uint8_t> data; ///< size is texture_bytes()
  double psnr_db = 0.0;      ///< of the sRGB-encoded values; infinite if lossless
};

/// Encodes a texture with the given codec. Without one, chooses the smallest form whose PSNR is at least min_psnr_db,
/// which rgb8 always reaches; among equal sizes, the one with the higher PSNR. The result depends on the arguments
/// only.
EncodedTexture encode_texture(const AlbedoTexture& texture, std::optional<TextureCodec> codec, double min_psnr_db);

/// Returns 10 log10(255^2 / mean squared error) over all channels of all texels.
double texture_psnr_db(const AlbedoTexture& texture, const TextureView& coded);

/// Encodes with at most 256 colours: all colours of the texture if that suffices, otherwise variance cuts refined by
/// Lloyd's algorithm.
std::vector<uint8_t> encode_palette8(const AlbedoTexture& texture);
/// Encodes with 2, 4 and 2 bits for red, green and blue, as levels between two values per channel.
std::vector<uint8_t> encode_r2g4b2(const AlbedoTexture& texture);
/// Encodes 4 x 4 blocks with two 5-6-5 endpoints and 2-bit indices.
std::vector<uint8_t> encode_bc1(const AlbedoTexture& texture);

} // namespace packtrace
