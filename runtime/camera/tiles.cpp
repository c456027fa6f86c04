#include "runtime/camera/tiles.h"

#include <algorithm>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace packtrace {

void for_each_tile(ImageSize size, ImageSize tile_size, Progress& progress,
                   const std::function<void(const Tile&)>& work) {
  if (size.pixels() == 0) return;
  const uint32_t columns = (size.width - 1) / tile_size.width + 1, rows = (size.height - 1) / tile_size.height + 1;
  std::vector<uint32_t> codes;
  codes.reserve(static_cast<size_t>(columns) * rows);
  for (uint32_t y = 0; y < rows; ++y)
    for (uint32_t x = 0; x < columns; ++x) codes.push_back(morton_code(x, y));
  std::sort(codes.begin(), codes.end());

  tbb::parallel_for(tbb::blocked_range<size_t>(0, codes.size(), 1), [&](const auto& range) {
    for (size_t i = range.begin(); i < range.end(); ++i) {
      Tile tile;
      tile.x0 = morton_even_bits(codes[i]) * tile_size.width;
      tile.y0 = morton_even_bits(codes[i] >> 1) * tile_size.height;
      tile.x1 = std::min(tile.x0 + tile_size.width, size.width);
      tile.y1 = std::min(tile.y0 + tile_size.height, size.height);
      work(tile);
      progress.advance(static_cast<uint64_t>(tile.x1 - tile.x0) * (tile.y1 - tile.y0));
    }
  });
}

} // namespace packtrace
