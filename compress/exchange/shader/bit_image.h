#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "compress/format/textures/texture_codec.h"

namespace packtrace {

/// Weights of a row or column of the filter of bits.
inline constexpr std::array<int32_t, 3> kBitWeights{1, 2, 1};
inline constexpr int32_t kBitLevels = 16; ///< sum of the products of all weights

/// An image of bits and the colours of areas without and with all of them.
struct BitImage {
  std::vector<uint8_t> bits; ///< 0 or 1 by texel
  std::array<Rgb8, 2> keys{};
};

/// Chooses two keys and then bits such that the filtered picture differs least from an image: error diffusion, then
/// flips and swaps of neighbours as long as one lowers the squared error.
/// Source: Floyd and Steinberg, "An Adaptive Algorithm for Spatial Grey Scale", 1976; Analoui and Allebach,
/// "Model-Based Halftoning Using Direct Binary Search", 1992.
BitImage encode_bits(const AlbedoTexture& source);

} // namespace packtrace
