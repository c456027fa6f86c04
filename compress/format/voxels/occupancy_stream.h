#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "compress/format/voxels/occupancy_format.h"
#include "compress/format/voxels/voxel_set.h"

namespace packtrace {

/// The `width` bits, at most 32, from `bit` on.
inline uint32_t read_packed(const uint32_t* words, uint64_t bit, uint32_t width) {
  const uint32_t* const at = words + bit / 32;
  const uint32_t shift = bit % 32;
  uint64_t value = at[0];
  if (shift + width > 32) value |= uint64_t{at[1]} << 32;
  return static_cast<uint32_t>(value >> shift & ((uint64_t{1} << width) - 1));
}

/// Voxels as a tree of bits without pointers that any voxel can be read from: occupancy_format.h describes the words.
class OccupancyStream {
public:
  /// Where a level's parts start, in words.
  struct LevelPlace {
    uint64_t masks = 0, groups = 0, blocks = 0, full = 0, pointers = 0;
    uint64_t last_block = 0; ///< number of the last block of ranks
  };

  OccupancyStream() = default;
  /// The words must match the header; find_occupancy_fault() checks those of unknown origin.
  OccupancyStream(const voxels::OccupancyHeader& header, std::vector<uint32_t> words);

  const voxels::OccupancyHeader& header() const { return header_; }
  std::span<const uint32_t> words() const { return words_; }
  const LevelPlace& place(uint32_t level) const { return places_[level]; }
  uint64_t swatch_place() const { return swatches_; }
  uint32_t levels() const { return header_.levels; }
  const VoxelIndex& size() const { return header_.size; }

  /// Bits of the words, and those of them that only make access fast (ranks).
  uint64_t bits() const { return words_.size() * uint64_t{32}; }
  uint64_t index_bits() const;
  /// Set bits of the last level: a shared node counts once, and voxels of full cells do not count.
  uint64_t stored_voxels() const { return header_.level[header_.levels - 1].set_bits; }

  /// Whether a voxel of the grid is set. Takes O(levels).
  bool test(VoxelIndex voxel) const;
  /// Palette index of a set voxel of the last level; 0 without swatches or for voxels of full cells.
  uint32_t swatch(VoxelIndex voxel) const;

  /// Meaning of a mask bit.
  enum class Cell : uint32_t { kEmpty, kFull, kNode };
  /// @param level 0..levels() - 2
  Cell cell(uint32_t level, uint64_t bit) const {
    if (mask_bit(level, bit)) return Cell::kNode;
    if ((header_.flags & voxels::kHasFull) == 0) return Cell::kEmpty;
    return read_bit(places_[level].full, bit - rank(level, bit)) ? Cell::kFull : Cell::kEmpty;
  }
  /// Node of the next level that belongs to a set bit.
  uint64_t node(uint32_t level, uint64_t bit) const { return node_of_edge(level, rank(level, bit)); }
  /// Node of the next level that belongs to the set bit of this rank.
  uint64_t node_of_edge(uint32_t level, uint64_t edge) const {
    const uint32_t width = header_.level[level + 1].pointer_bits;
    return width == 0 ? edge : read_field(places_[level + 1].pointers, edge * width, width);
  }
  bool mask_bit(uint32_t level, uint64_t bit) const { return read_bit(places_[level].masks, bit); }
  /// The 8 bits of a node.
  uint32_t mask(uint32_t level, uint64_t node) const {
    return words_[places_[level].masks + node / 4] >> (8 * (node % 4)) & 0xffu;
  }
  /// Set bits of a level's masks before `bit`, counted from the nearest block: reads at most 16 words (32 in the last
  /// block of a level) and two ranks. Not for a last level without swatches.
  [[gnu::always_inline]] uint64_t rank(uint32_t level, uint64_t bit) const {
    const LevelPlace& place = places_[level];
    const uint64_t block = std::min((bit + voxels::kRankBits / 2) / voxels::kRankBits, place.last_block),
                   group = block / voxels::kRankGroupBlocks;
    uint64_t rank = group == 0 ? 0 : words_[place.groups + group - 1];
    if (block > 0) rank += words_[place.blocks + (block - 1) / 2] >> (16 * ((block - 1) % 2)) & 0xffffu;
    const uint64_t word = place.masks + bit / 32, start = place.masks + block * (voxels::kRankBits / 32);
    rank += static_cast<uint64_t>(std::popcount(words_[word] & ((1u << (bit % 32)) - 1)));
    const uint64_t between = set_bits(std::min(word, start), std::max(word, start));
    return word >= start ? rank + between : rank - between;
  }
  uint32_t read_field(uint64_t word, uint64_t bit, uint32_t width) const {
    return read_packed(words_.data() + word, bit, width);
  }

private:
  /// Set bits of the words first..last - 1.
  [[gnu::always_inline]] uint64_t set_bits(uint64_t first, uint64_t last) const {
    const uint32_t* word = words_.data() + first;
    const uint32_t* const end = words_.data() + last;
    uint64_t sum = 0;
    for (; end - word >= 2; word += 2) {
      uint64_t pair;
      std::memcpy(&pair, word, sizeof pair);
      sum += static_cast<uint64_t>(std::popcount(pair));
    }
    return word == end ? sum : sum + static_cast<uint64_t>(std::popcount(*word));
  }
  bool read_bit(uint64_t word, uint64_t bit) const { return (words_[word + bit / 32] >> (bit % 32) & 1) != 0; }
  /// Bit of the last level that holds a voxel; none if a level above decides; `full` is then its result.
  std::optional<uint64_t> leaf_bit(VoxelIndex voxel, bool& full) const;

  voxels::OccupancyHeader header_{};
  std::vector<uint32_t> words_;
  std::array<LevelPlace, voxels::kMaxLevels> places_{};
  uint64_t swatches_ = 0;
};

/// Options of encode_occupancy().
struct OccupancyOptions {
  uint32_t levels = 0;      ///< kMinLevels..kMaxLevels; 0: those that take the fewest bits
  bool dag = false;         ///< store equal subtrees once where that takes fewer bits; not with swatches
  std::optional<bool> full; ///< bits for full cells; unset: if that takes fewer bits
  /// Palette index of each set voxel, in the order of VoxelSet::for_each(); empty: no swatches. Only voxels with an
  /// empty neighbour or at the border keep theirs.
  std::span<const uint8_t> swatches;
  uint32_t palette_count = 0;
};

/// Encodes a set of at least one voxel. Throws Error(kUsage) for options out of range, Error(kLimitExceeded) if a level
/// has more than 2^32 bits.
OccupancyStream encode_occupancy(const VoxelSet& set, const OccupancyOptions& options);

/// Set voxels of a stream: those of every reference to a shared node, and of full cells. Takes time in the number of
/// stored nodes. If nodes are shared, takes 8 bytes per node, and a hash table of nodes at the grid's far sides.
uint64_t count_occupied(const OccupancyStream& stream);

/// All voxels of a stream.
VoxelSet decode_occupancy(const OccupancyStream& stream);

/// Returns why header or words are damaged; nullopt if OccupancyStream may read them. Allocates nothing.
std::optional<std::string_view> find_occupancy_fault(const voxels::OccupancyHeader& header,
                                                     std::span<const uint32_t> words);

} // namespace packtrace
