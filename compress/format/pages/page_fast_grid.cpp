#include "compress/format/pages/page_fast_grid.h"

#include <algorithm>

namespace packtrace::page_fast {

std::array<int32_t, 3> grid_guess(const GridBlock& block, uint32_t x, uint32_t y) {
  const auto point = [&](uint32_t column, uint32_t row) { return static_cast<int32_t>(block.point(column, row)); };
  if (x > 0 && y > 0) return {point(x - 1, y), point(x, y - 1), point(x - 1, y - 1)};
  if (x > 1) return {point(x - 1, 0), point(x - 1, 0), point(x - 2, 0)};
  if (y > 1) return {point(0, y - 1), point(0, y - 1), point(0, y - 2)};
  return {x + y > 0 ? point(0, 0) : kNoPoint, kNoPoint, kNoPoint};
}

void walk_grid(const GridBlock& block, const SharedBorders& shared, const uint64_t* residuals, uint64_t* words) {
  const uint32_t stride = block.columns + 1;
  const uint64_t *left = shared[kLeftColumn], *lowest = shared[kLowestRow];
  if (lowest != nullptr) {
    std::copy_n(lowest, stride, words);
  } else {
    words[0] = left != nullptr ? left[0] : *residuals++;
    uint64_t step = 0;
    for (uint32_t x = 1; x < stride; ++x) {
      step += *residuals++;
      words[x] = words[x - 1] + step;
    }
  }
  uint64_t step = 0;
  for (uint32_t y = 1; y <= block.rows; ++y) {
    const uint64_t* below = words;
    words += stride;
    if (left == nullptr) step += *residuals++;
    words[0] = left != nullptr ? left[y] : below[0] + step;
    uint64_t rise = words[0] - below[0]; // from the row below to this one, at the previous point
    for (uint32_t x = 1; x < stride; ++x) {
      rise += *residuals++;
      words[x] = below[x] + rise;
    }
  }
}

void GridBorders::add(const GridBlock& block, const Frames& frames,
                      const std::array<const uint64_t*, kChannels>& words) {
  Cluster& cluster = clusters_.emplace_back(Cluster{block, frames, {}});
  for (uint32_t channel = 0; channel < kChannels; ++channel) {
    if (words[channel] == nullptr) continue;
    cluster.first[channel][kLeftColumn] = words_.size();
    for (uint32_t y = 0; y <= block.rows; ++y) words_.push_back(words[channel][block.point(block.columns, y)]);
    cluster.first[channel][kLowestRow] = words_.size();
    for (uint32_t x = 0; x <= block.columns; ++x) words_.push_back(words[channel][block.point(x, block.rows)]);
  }
}

bool GridBorders::share(GridBorder border, size_t neighbour, Channel channel, const GridBlock& block,
                        const ChannelFrame& frame, uint64_t* words) const {
  if (neighbour == 0 || neighbour > clusters_.size()) return false;
  const Cluster& from = clusters_[clusters_.size() - neighbour];
  const uint32_t count = points_of(block, border);
  if (points_of(from.block, border) != count || !frame.can_share(from.frames[channel])) return false;
  const uint64_t* first = words_.data() + from.first[channel][border];
  for (uint32_t i = 0; i < count; ++i) words[i] = moved_word(from.frames[channel], first[i], frame);
  return true;
}

} // namespace packtrace::page_fast
