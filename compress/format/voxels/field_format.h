#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace packtrace::voxels {

inline constexpr uint32_t kFieldBand = 3;   ///< voxels on both sides of the surface whose distances are stored
inline constexpr uint32_t kFieldMargin = 4; ///< samples around the voxels of the geometry, on each side
inline constexpr uint32_t kBrickCells = 8;  ///< cells of a brick along an axis
inline constexpr uint32_t kBrickSide = kBrickCells + 1; ///< samples of a brick along an axis: it shares its last ones
inline constexpr uint32_t kBrickSamples = kBrickSide * kBrickSide * kBrickSide;
inline constexpr uint32_t kStoredBrick = 1u << 31;
inline constexpr uint32_t kInsideBrick = 1u << 30; ///< of a brick that is not stored

/// A distance field: this header, then one word per brick, x fastest, then the samples of the stored bricks, in order,
/// as bytes or 16-bit numbers, packed into words. A brick's word is kStoredBrick plus its number, or, for a brick
/// without a sample in the band, how many bricks away the nearest stored one is at least (1..2^16), plus kInsideBrick.
/// Sample (i, j, k) is the distance at origin + edge (i, j, k): value / half * band * edge - band * edge, half = 127 or
/// 32767.
struct FieldHeader {
  std::array<uint32_t, 3> size;   ///< samples per axis, >= 2
  std::array<uint32_t, 3> bricks; ///< per axis: they cover all cells
  uint32_t sample_bits;           ///< 8 or 16
  uint32_t stored_bricks;
  uint64_t word_count;
};

static_assert(std::is_trivially_copyable_v<FieldHeader> && sizeof(FieldHeader) == 40 &&
              offsetof(FieldHeader, word_count) == 32);

} // namespace packtrace::voxels
