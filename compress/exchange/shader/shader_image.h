#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "compress/format/textures/texture_codec.h"

namespace packtrace {

/// Forms of the texels of an image in a shader. All values are sRGB-encoded bytes.
enum class TexelFormat : uint32_t {
  kBit,    ///< 1 bit; the sum of the 3 x 3 bits around, weighted 1 2 1, chooses among 17 colours between two keys
  kGrey,   ///< 8 bits: a place on a curve of colours, piecewise linear between kRampKnots
  kR2G4B2, ///< 8 bits: 4 x 16 x 4 levels between two keys
};
inline constexpr std::array<std::string_view, 3> kTexelFormatNames{"bit", "grey", "r2g4b2"};

inline constexpr uint32_t kRampKnots = 17;

/// An image whose words a shader reads as a constant array.
struct ShaderImage {
  TexelFormat format = TexelFormat::kR2G4B2;
  uint32_t width = 0, height = 0;
  /// Texels row by row from the top without padding, the first one in the lowest bits.
  std::vector<uint32_t> words;
  std::array<Rgb8, 2> keys{}; ///< of kBit: all bits clear, all set; of kR2G4B2: lowest and highest levels
  std::vector<uint32_t> ramp; ///< of kGrey: red, green and blue of each knot from the lowest byte

  /// Decodes one texel as the shader does. x < width, y < height; row 0 is on top. Beyond the image's sides its bits
  /// repeat.
  Rgb8 texel(uint32_t x, uint32_t y) const;
};

/// Elements of the arrays of an image, as kMaxShaderElements counts them.
uint64_t shader_image_elements(TexelFormat format, uint32_t width, uint32_t height);

/// Longest side of the largest image of the same shape, at most `width` x `height`, that fits; 0 if none does.
uint32_t largest_image_side(TexelFormat format, uint32_t width, uint32_t height, uint64_t max_elements);

/// Encodes an image of at least one texel, minimising the error. The same texels give the same words.
ShaderImage encode_shader_image(const AlbedoTexture& source, TexelFormat format);

/// Bytes of working memory of encode_shader_image(), at most.
uint64_t encode_memory_bytes(uint32_t width, uint32_t height);

struct ImageDifference {
  double psnr_db = 0.0;   ///< over all channels; infinite if equal
  uint32_t max_error = 0; ///< largest difference of a channel, of 255
};

/// Compares decoded texels with those that were encoded.
ImageDifference difference_of(const ShaderImage& image, const AlbedoTexture& source);

/// Width and height with a new longest side and the same shape; at least one texel each.
std::array<uint32_t, 2> scaled_size(uint32_t width, uint32_t height, uint32_t longest);

/// An image reduced to a longest side. Texels are averages in linear light over the area that they cover.
/// @param longest at least 1 and at most the longest side of `source`
AlbedoTexture scaled_down(const AlbedoTexture& source, uint32_t longest);

} // namespace packtrace
