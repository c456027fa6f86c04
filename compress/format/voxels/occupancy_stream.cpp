#include "compress/format/voxels/occupancy_stream.h"

#include <algorithm>

namespace packtrace {

using namespace voxels;

OccupancyStream::OccupancyStream(const OccupancyHeader& header, std::vector<uint32_t> words)
    : header_(header), words_(std::move(words)) {
  uint64_t at = 0;
  for (uint32_t l = 0; l < header.levels; ++l) {
    const OccupancyLevel& level = header.level[l];
    const bool last = l + 1 == header.levels;
    LevelPlace& place = places_[l];
    place.masks = at;
    at += words_for_bits(level.mask_bits);
    place.groups = at;
    place.last_block = level.mask_bits == 0 ? 0 : (level.mask_bits - 1) / kRankBits;
    place.blocks = place.groups + place.last_block / kRankGroupBlocks;
    if (!last || header.swatch_bits > 0) at += rank_words(level.mask_bits);
    place.full = at;
    if (!last && (header.flags & kHasFull) != 0) at += words_for_bits(level.mask_bits - level.set_bits);
    place.pointers = at;
    if (level.pointer_bits > 0) at += words_for_bits(uint64_t{header.level[l - 1].set_bits} * level.pointer_bits);
  }
  swatches_ = at;
}

uint64_t OccupancyStream::index_bits() const {
  uint64_t words = 0;
  for (uint32_t l = 0; l < header_.levels; ++l)
    if (l + 1 < header_.levels || header_.swatch_bits > 0) words += rank_words(header_.level[l].mask_bits);
  return words * 32;
}

std::optional<uint64_t> OccupancyStream::leaf_bit(VoxelIndex voxel, bool& full) const {
  const uint32_t shift = header_.levels - 1;
  uint64_t bit =
      (uint64_t{voxel[2] >> shift} * header_.top[1] + (voxel[1] >> shift)) * header_.top[0] + (voxel[0] >> shift);
  for (uint32_t l = 0; l < shift; ++l) {
    const Cell state = cell(l, bit);
    full = state == Cell::kFull;
    if (state != Cell::kNode) return std::nullopt;
    const uint32_t s = shift - 1 - l;
    bit = 8 * node(l, bit) + (voxel[0] >> s & 1) + 2 * (voxel[1] >> s & 1) + 4 * (voxel[2] >> s & 1);
  }
  return bit;
}

bool OccupancyStream::test(VoxelIndex voxel) const {
  bool full = false;
  const std::optional<uint64_t> bit = leaf_bit(voxel, full);
  return bit ? mask_bit(header_.levels - 1, *bit) : full;
}

uint32_t OccupancyStream::swatch(VoxelIndex voxel) const {
  if (header_.swatch_bits == 0) return 0;
  bool full = false;
  const std::optional<uint64_t> bit = leaf_bit(voxel, full);
  const uint32_t last = header_.levels - 1;
  if (!bit || !mask_bit(last, *bit)) return 0;
  return read_field(swatches_, rank(last, *bit) * header_.swatch_bits, header_.swatch_bits);
}

VoxelSet decode_occupancy(const OccupancyStream& stream) {
  VoxelSet set(stream.size());
  const auto [nx, ny, nz] = stream.size();
  const uint32_t shift = stream.levels() - 1;
  const std::array<uint32_t, 3>& top = stream.header().top;
  struct Item {
    uint32_t level;
    uint64_t bit;
    VoxelIndex low;
  };
  std::vector<Item> items;
  for (uint32_t z = 0; z < top[2]; ++z)
    for (uint32_t y = 0; y < top[1]; ++y)
      for (uint32_t x = 0; x < top[0]; ++x) {
        items.push_back({0, (uint64_t{z} * top[1] + y) * top[0] + x, {x << shift, y << shift, z << shift}});
        while (!items.empty()) {
          const Item item = items.back();
          items.pop_back();
          const bool last = item.level == shift;
          const auto cell = last ? stream.mask_bit(item.level, item.bit) ? OccupancyStream::Cell::kFull
                                                                         : OccupancyStream::Cell::kEmpty
                                 : stream.cell(item.level, item.bit);
          if (cell == OccupancyStream::Cell::kEmpty) continue;
          const uint32_t s = shift - item.level;
          if (cell == OccupancyStream::Cell::kFull) {
            for (uint32_t k = item.low[2]; k < std::min(item.low[2] + (1u << s), nz); ++k)
              for (uint32_t j = item.low[1]; j < std::min(item.low[1] + (1u << s), ny); ++j)
                for (uint32_t i = item.low[0]; i < std::min(item.low[0] + (1u << s), nx); ++i) set.set({i, j, k});
            continue;
          }
          const uint64_t node = stream.node(item.level, item.bit);
          for (uint32_t o = 0; o < 8; ++o)
            items.push_back({item.level + 1,
                             8 * node + o,
                             {item.low[0] + ((o & 1) << (s - 1)), item.low[1] + ((o >> 1 & 1) << (s - 1)),
                              item.low[2] + ((o >> 2) << (s - 1))}});
        }
      }
  return set;
}

} // namespace packtrace
