#pragma once

#include <vector>

#include "compress/format/voxels/voxel_set.h"

namespace packtrace {

/// Cells of 2^k voxels along an axis, for k = 0, 1, ...: which hold a set voxel, and which are full. Voxels outside the
/// grid match every query.
class CellPyramid {
public:
  /// @param set must outlive the pyramid
  /// @param full_voxels those that may belong to a full cell; null: all of the set. Must outlive the pyramid.
  CellPyramid(const VoxelSet& set, uint32_t levels, const VoxelSet* full_voxels);

  const VoxelSet& any(uint32_t k) const { return k == 0 ? set_ : any_[k - 1]; }
  const VoxelSet& full(uint32_t k) const { return k == 0 ? full_voxels_ : full_[k - 1]; }
  uint64_t any_count(uint32_t k) const { return any_counts_[k]; }
  /// Cells that hold a set voxel and are not full.
  uint64_t mixed_count(uint32_t k) const { return mixed_counts_[k]; }

private:
  const VoxelSet& set_;
  const VoxelSet& full_voxels_;
  std::vector<VoxelSet> any_, full_;
  std::vector<uint64_t> any_counts_, mixed_counts_;
};

} // namespace packtrace
