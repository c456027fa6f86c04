#pragma once

#include <cstdint>

namespace packtrace {

inline constexpr uint32_t kMortonBits = 21; ///< bits per axis

/// Interleaves the bits of three numbers below 2^kMortonBits, x lowest: their position along a Z-order curve.
constexpr uint64_t morton_code(uint64_t x, uint64_t y, uint64_t z) {
  constexpr auto spread = [](uint64_t v) {
    v = (v | (v << 32)) & 0x001f00000000ffffu;
    v = (v | (v << 16)) & 0x001f0000ff0000ffu;
    v = (v | (v << 8)) & 0x100f00f00f00f00fu;
    v = (v | (v << 4)) & 0x10c30c30c30c30c3u;
    return (v | (v << 2)) & 0x1249249249249249u;
  };
  return spread(x) | spread(y) << 1 | spread(z) << 2;
}

} // namespace packtrace
