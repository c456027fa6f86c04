#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/proxies/occluding_triangles.h"
#include "compress/bake/proxies/proxy_config.h"
#include "compress/format/voxels/voxel_set.h"
#include "pbrt_import/base/memory_budget.h"

namespace packtrace {

/// The voxels of a geometry and how far they are from its surface.
struct GeometryVoxels {
  VoxelFrame frame;
  VoxelSet set;
  bool filled = false;
  /// Largest distance in object units from samples of the surface, at most half a voxel apart, to the centre of the
  /// nearest voxel; for conservative voxels at most half the diagonal of one.
  double surface_error = 0.0;
  /// Largest distance from the centre of a voxel that a triangle sets to the triangles that set it.
  double voxel_error = 0.0;
  std::vector<uint32_t> slots; ///< by voxel in the order of the set: slot of the nearest of those triangles; 0 inside
};

/// Voxelises triangles on an integer grid: their lattice, of which the longest side is divided into config.voxels.
/// Lattices wider than 2^24 steps are rounded to that first, which the errors include.
/// @param source of at least one triangle
/// @param what names the geometry in messages
/// Throws MemoryError, with the largest number of voxels that fits the budget; Error(kUsage) for a size out of range.
GeometryVoxels voxelize(const BakedFile& file, std::span<const uint32_t> runs, const OccludingTriangles& source,
                        const ProxyConfig& config, const MemoryBudget& budget, const std::string& what);

/// The grid of voxelize() over a geometry.
VoxelFrame voxel_frame(const OccludingTriangles& source, uint32_t voxels);

/// The voxels whose centres lie inside a closed geometry.
VoxelSet inside_voxels(const OccludingTriangles& source, uint32_t voxels);

} // namespace packtrace
