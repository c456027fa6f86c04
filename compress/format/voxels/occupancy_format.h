#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace packtrace::voxels {

inline constexpr uint32_t kMinLevels = 2, kMaxLevels = 16;
inline constexpr uint32_t kRankBits = 1024;      ///< mask bits per rank block
inline constexpr uint32_t kRankGroupBlocks = 64; ///< rank blocks per group, whose start has a 32-bit rank
inline constexpr uint32_t kMaxSwatches = 256;

// OccupancyHeader::flags
inline constexpr uint32_t kHasFull = 1u << 0; ///< cells without a node have a bit that is set if they are full
inline constexpr uint32_t kOccupancyFlags = kHasFull;

/// One level of a stream. Level 0 is the grid of top cells, x fastest; each level below has a node of 8 bits, one per
/// octant (bit x + 2 y + 4 z), for each set bit of the level above, in order.
struct OccupancyLevel {
  uint32_t mask_bits;    ///< level 0: number of top cells; else 8 times the number of stored nodes
  uint32_t set_bits;     ///< of the masks
  uint32_t pointer_bits; ///< width of the node numbers that the bits above refer to; 0: the n-th bit has the n-th node
  uint32_t reserved;
};

/// An occupancy stream: this header, then 32-bit words. Per level, from the top: masks; ranks, except at the last level
/// of a stream without swatches; full bits, except at the last level; pointers. Then swatches. Each of these starts at
/// a whole word; unused bits are zero.
struct OccupancyHeader {
  uint32_t levels; ///< kMinLevels..kMaxLevels; voxels are the bits of the last
  uint32_t flags;
  std::array<uint32_t, 3> size;                 ///< voxels per axis
  std::array<uint32_t, 3> top;                  ///< top cells per axis, each of 2^(levels - 1) voxels along an axis
  uint32_t swatch_bits;                         ///< per voxel of the last level, in order: index into the palette; 0..8
  uint32_t palette_count;                       ///< 0 without swatches
  uint64_t word_count;                          ///< of the words behind the header
  std::array<OccupancyLevel, kMaxLevels> level; ///< those from `levels` on are zero
};

static_assert(std::is_trivially_copyable_v<OccupancyHeader> && sizeof(OccupancyLevel) == 16 &&
              sizeof(OccupancyHeader) == 48 + 16 * kMaxLevels && offsetof(OccupancyHeader, word_count) == 40);

/// Words of the ranks of so many mask bits: 32 bits for each group but the first, 16 for each block but the first.
constexpr uint64_t rank_words(uint64_t mask_bits) {
  const uint64_t blocks = mask_bits == 0 ? 0 : (mask_bits - 1) / kRankBits;
  return blocks / kRankGroupBlocks + (blocks + 1) / 2;
}

constexpr uint64_t words_for_bits(uint64_t bits) { return (bits + 31) / 32; }

} // namespace packtrace::voxels
