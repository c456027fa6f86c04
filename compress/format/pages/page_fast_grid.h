#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "compress/format/pages/page_fast.h"

namespace packtrace::page_fast {

/// Words of one channel on the borders of a grid cluster; null where they are not shared.
using SharedBorders = std::array<const uint64_t*, kGridBorders>;

inline uint32_t points_of(const GridBlock& block, GridBorder border) {
  return (border == kLeftColumn ? block.rows : block.columns) + 1;
}

/// Returns the number of points of a block that are on no shared border.
inline uint32_t count_unshared(const GridBlock& block, bool left, bool below) {
  return (left ? block.columns : block.columns + 1) * (below ? block.rows : block.rows + 1);
}

/// Returns the points p, q, o that predict a point of a grid as p + q - o: by a parallelogram, on the left column and
/// the lowest row by continuing the last step. kNoPoint means 0.
inline constexpr int32_t kNoPoint = -1;
std::array<int32_t, 3> grid_guess(const GridBlock& block, uint32_t x, uint32_t y);

/// Reconstructs the words of one channel of a grid cluster.
/// @param residuals words of the points that are not shared, row by row
/// @param words set by grid point
void walk_grid(const GridBlock& block, const SharedBorders& shared, const uint64_t* residuals, uint64_t* words);

/// The right columns and highest rows of the grid clusters of a page, from which later clusters take their left columns
/// and lowest rows.
class GridBorders {
public:
  using Frames = std::array<ChannelFrame, kChannels>;

  void clear() { clusters_.clear(), words_.clear(); }
  size_t size() const { return clusters_.size(); }

  /// Adds the next cluster.
  /// @param words by channel and grid point; null for absent channels and those without predictions
  void add(const GridBlock& block, const Frames& frames, const std::array<const uint64_t*, kChannels>& words);

  /// Computes the words of a channel on a border of the next cluster, from those of an earlier cluster. Returns false
  /// if there is no such cluster, if its border has another number of points, or if its words do not fit.
  /// @param neighbour number of the earlier cluster, counted backwards from 1
  bool share(GridBorder border, size_t neighbour, Channel channel, const GridBlock& block, const ChannelFrame& frame,
             uint64_t* words) const;

private:
  struct Cluster {
    GridBlock block;
    Frames frames;
    std::array<std::array<size_t, kGridBorders>, kChannels> first; ///< in words_
  };
  std::vector<Cluster> clusters_;
  std::vector<uint64_t> words_;
};

} // namespace packtrace::page_fast
