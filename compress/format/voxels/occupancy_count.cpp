#include <algorithm>
#include <bit>
#include <unordered_map>

#include "compress/format/voxels/occupancy_stream.h"

namespace packtrace {
namespace {

using Cell = OccupancyStream::Cell;

class OccupiedCounter {
public:
  explicit OccupiedCounter(const OccupancyStream& stream) : stream_(stream), last_(stream.levels() - 1) {
    const voxels::OccupancyHeader& h = stream.header();
    bool shared = false;
    for (uint32_t l = 1; l < h.levels; ++l) shared |= h.level[l].pointer_bits > 0;
    for (uint32_t l = 1; l + 1 < h.levels && shared; ++l) known_[l].resize(h.level[l].mask_bits / 8, kUnknown);
  }

  uint64_t run() {
    const VoxelIndex& top = stream_.header().top;
    uint64_t sum = 0, bit = 0;
    for (uint32_t z = 0; z < top[2]; ++z)
      for (uint32_t y = 0; y < top[1]; ++y)
        for (uint32_t x = 0; x < top[0]; ++x) sum += of_cell(0, bit++, {x << last_, y << last_, z << last_});
    return sum;
  }

private:
  static constexpr uint64_t kUnknown = ~uint64_t{0};

  /// Voxels of a cell that lie in the grid.
  uint64_t size_of(uint32_t level, const VoxelIndex& low) const {
    uint64_t product = 1;
    for (size_t a = 0; a < 3; ++a) {
      const uint32_t size = stream_.size()[a];
      product *= low[a] < size ? std::min(1u << (last_ - level), size - low[a]) : 0;
    }
    return product;
  }

  /// @param level not the last
  uint64_t of_cell(uint32_t level, uint64_t bit, const VoxelIndex& low) {
    const Cell cell = stream_.cell(level, bit);
    if (cell == Cell::kEmpty) return 0;
    const uint64_t size = size_of(level, low);
    if (cell == Cell::kFull || size == 0) return size;
    const uint64_t node = stream_.node(level, bit);
    const uint32_t cut = cut_axes(level, low);
    if (known_[level + 1].empty()) return of_node(level + 1, node, low, cut == 0);
    if (cut != 0) {
      const auto found = known_cut_[level + 1].find(8 * node + cut);
      if (found != known_cut_[level + 1].end()) return found->second;
      return known_cut_[level + 1][8 * node + cut] = of_node(level + 1, node, low, false);
    }
    uint64_t& known = known_[level + 1][node];
    if (known == kUnknown) known = of_node(level + 1, node, low, true);
    return known;
  }

  /// Bit a: the cell extends beyond the grid's far side along axis a. Only the last cell along an axis does, so level
  /// and cut axes determine the part of a node that counts.
  uint32_t cut_axes(uint32_t level, const VoxelIndex& low) const {
    uint32_t cut = 0;
    for (uint32_t a = 0; a < 3; ++a) cut |= uint32_t{low[a] + (1u << (last_ - level)) > stream_.size()[a]} << a;
    return cut;
  }

  uint64_t of_node(uint32_t level, uint64_t node, const VoxelIndex& low, bool whole) {
    if (level == last_ && whole) return static_cast<uint64_t>(std::popcount(stream_.mask(level, node)));
    const uint32_t shift = last_ - level;
    uint64_t sum = 0;
    for (uint32_t o = 0; o < 8; ++o) {
      const VoxelIndex at = {low[0] + ((o & 1) << shift), low[1] + ((o >> 1 & 1) << shift),
                             low[2] + ((o >> 2) << shift)};
      if (level < last_)
        sum += of_cell(level, 8 * node + o, at);
      else if (stream_.mask_bit(level, 8 * node + o))
        sum += size_of(level, at);
    }
    return sum;
  }

  const OccupancyStream& stream_;
  uint32_t last_;
  std::array<std::vector<uint64_t>, voxels::kMaxLevels> known_; ///< by node; empty if no node is shared
  std::array<std::unordered_map<uint64_t, uint64_t>, voxels::kMaxLevels> known_cut_; ///< by 8 * node + cut_axes()
};

} // namespace

uint64_t count_occupied(const OccupancyStream& stream) { return OccupiedCounter(stream).run(); }

} // namespace packtrace
