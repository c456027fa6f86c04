#pragma once

#include <cstdint>
#include <functional>

#include "pbrt_import/base/progress.h"
#include "runtime/camera/gbuffer.h"

namespace packtrace {

inline constexpr uint32_t kTileSize = 32; ///< pixels per axis

/// Half-open pixel rectangle.
struct Tile {
  uint32_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

/// Calls `work` for every tile of an image on all cores, in Morton order, so that neighbouring tiles are processed
/// close in time. Tiles at the right and lower edge may be smaller. The tiles are the same for any number of threads.
/// Each finished tile advances progress by its pixels. Throws what `work` throws, and Error(kCancelled).
void for_each_tile(ImageSize size, ImageSize tile_size, Progress& progress,
                   const std::function<void(const Tile&)>& work);

/// The same with tiles of kTileSize x kTileSize pixels.
inline void for_each_tile(ImageSize size, Progress& progress, const std::function<void(const Tile&)>& work) {
  for_each_tile(size, {kTileSize, kTileSize}, progress, work);
}

/// Extracts the even bits of a Morton code: bit 2i of code becomes bit i.
constexpr uint32_t morton_even_bits(uint32_t code) {
  code &= 0x55555555u;
  code = (code | (code >> 1)) & 0x33333333u;
  code = (code | (code >> 2)) & 0x0f0f0f0fu;
  code = (code | (code >> 4)) & 0x00ff00ffu;
  return (code | (code >> 8)) & 0x0000ffffu;
}

/// Interleaves bits into a Morton code: bits of x at even positions, of y at odd positions.
constexpr uint32_t morton_code(uint32_t x, uint32_t y) {
  const auto spread = [](uint32_t v) {
    v &= 0xffffu;
    v = (v | (v << 8)) & 0x00ff00ffu;
    v = (v | (v << 4)) & 0x0f0f0f0fu;
    v = (v | (v << 2)) & 0x33333333u;
    return (v | (v << 1)) & 0x55555555u;
  };
  return spread(x) | (spread(y) << 1);
}

} // namespace packtrace
