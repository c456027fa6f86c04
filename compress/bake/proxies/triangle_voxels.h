#pragma once

#include <array>
#include <cstdint>

#include "compress/bake/proxies/voxel_rule.h"
#include "compress/format/voxels/voxel_set.h"

namespace packtrace {

/// A point in units of an N-th of the lattice step, relative to the grid's origin: at most 2^37.
using FinePoint = std::array<int64_t, 3>;
using FineTriangle = std::array<FinePoint, 3>;

/// Visits the voxels of a triangle, in exact integer arithmetic, row by row: visit(y, z, first_x, last_x).
/// Source: Schwarz and Seidel, "Fast Parallel Surface and Solid Voxelization on GPUs", 2010: the separating axes of a
/// triangle and a cube as linear functions of the voxel's indices, here solved for the range of x in a row.
/// @param edge of a voxel in the units of FinePoint, 1..2^25
/// @param size of the grid; voxels outside it are not visited
class TriangleVoxels {
public:
  TriangleVoxels(const FineTriangle& triangle, int64_t edge, VoxelIndex size, VoxelRule rule);

  template <class Visit>
  void for_each_row(const Visit& visit) const {
    if (empty_) return;
    for (uint32_t z = lo_[2]; z <= hi_[2]; ++z)
      for (uint32_t y = lo_[1]; y <= hi_[1]; ++y) {
        int64_t first = lo_[0], last = hi_[0];
        if (row(y, z, first, last)) visit(y, z, static_cast<uint32_t>(first), static_cast<uint32_t>(last));
      }
  }

private:
  using Int128 = __int128;
  /// a x + b y + c z + d >= 0
  struct HalfSpace {
    std::array<Int128, 3> axis;
    Int128 constant;
  };

  void add_axis(const std::array<Int128, 3>& direction, const FineTriangle& triangle, int64_t edge, VoxelRule rule);
  bool row(uint32_t y, uint32_t z, int64_t& first, int64_t& last) const;

  VoxelIndex lo_{}, hi_{};
  bool empty_ = true;
  uint32_t count_ = 0;
  std::array<HalfSpace, 20> half_spaces_;
};

/// Flips `crossings` at the first voxel along x whose centre lies behind the triangle, for each row of centres that
/// crosses it. After the triangles of a closed surface, prefix_parity() gives the voxels whose centres lie inside.
/// Exact; a row through an edge crosses exactly one of two triangles that share it.
void add_crossings(const FineTriangle& triangle, int64_t edge, VoxelSet& crossings);

/// Replaces each row by its running parity.
void prefix_parity(VoxelSet& crossings);

} // namespace packtrace
