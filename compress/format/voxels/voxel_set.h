#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Number of voxels, or index of a voxel or a node, along x, y and z.
using VoxelIndex = std::array<uint32_t, 3>;

/// Most voxels along an axis.
inline constexpr uint32_t kMaxGridSize = 4096;

/// Position and size of a grid: voxel (i, j, k) is the closed cube from origin + edge (i, j, k) to
/// origin + edge (i + 1, j + 1, k + 1).
struct VoxelFrame {
  DVec3 origin{0.0}; ///< object space
  double edge = 1.0; ///< of a voxel, object units; > 0
  VoxelIndex size{}; ///< voxels per axis, 1..kMaxGridSize

  DVec3 center(VoxelIndex v) const { return origin + edge * (DVec3(v[0], v[1], v[2]) + 0.5); }
};

/// One bit for each voxel of a grid, rows along x in whole words.
class VoxelSet {
public:
  VoxelSet() = default;
  explicit VoxelSet(VoxelIndex size)
      : size_(size), row_words_((size[0] + 63) / 64), words_(size_t{row_words_} * size[1] * size[2]) {}

  /// Bytes that a set of this size takes.
  static uint64_t bytes_for(VoxelIndex size) { return uint64_t{(size[0] + 63) / 64} * 8 * size[1] * size[2]; }

  const VoxelIndex& size() const { return size_; }
  uint32_t row_words() const { return row_words_; }
  uint64_t* row(uint32_t y, uint32_t z) { return &words_[(size_t{z} * size_[1] + y) * row_words_]; }
  const uint64_t* row(uint32_t y, uint32_t z) const { return &words_[(size_t{z} * size_[1] + y) * row_words_]; }

  /// The voxel must lie in the grid.
  bool test(VoxelIndex v) const { return (row(v[1], v[2])[v[0] / 64] >> (v[0] % 64) & 1) != 0; }
  void set(VoxelIndex v) { row(v[1], v[2])[v[0] / 64] |= uint64_t{1} << (v[0] % 64); }
  void clear(VoxelIndex v) { row(v[1], v[2])[v[0] / 64] &= ~(uint64_t{1} << (v[0] % 64)); }
  /// False outside the grid, too. Takes signed indices, so that neighbours of border voxels can be queried.
  bool contains(int64_t x, int64_t y, int64_t z) const {
    if (x < 0 || y < 0 || z < 0 || x >= size_[0] || y >= size_[1] || z >= size_[2]) return false;
    return test({static_cast<uint32_t>(x), static_cast<uint32_t>(y), static_cast<uint32_t>(z)});
  }

  uint64_t count() const {
    uint64_t count = 0;
    for (const uint64_t word : words_) count += static_cast<uint64_t>(std::popcount(word));
    return count;
  }
  void merge(const VoxelSet& other) {
    for (size_t i = 0; i < words_.size(); ++i) words_[i] |= other.words_[i];
  }
  bool operator==(const VoxelSet&) const = default;

  /// Visits all voxels of the set in rows along x: visit(VoxelIndex).
  template <class Visit>
  void for_each(const Visit& visit) const {
    for (uint32_t z = 0; z < size_[2]; ++z)
      for (uint32_t y = 0; y < size_[1]; ++y)
        for (uint32_t w = 0; w < row_words_; ++w)
          for (uint64_t word = row(y, z)[w]; word != 0; word &= word - 1)
            visit(VoxelIndex{w * 64 + static_cast<uint32_t>(std::countr_zero(word)), y, z});
  }

private:
  VoxelIndex size_{};
  uint32_t row_words_ = 0;
  std::vector<uint64_t> words_;
};

} // namespace packtrace
