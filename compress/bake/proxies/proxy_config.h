#pragma once

#include <cstdint>

#include "compress/bake/proxies/voxel_rule.h"

namespace packtrace {

enum class ProxyUse : uint32_t { kOff, kVoxels, kField };

/// Proxies of a bake: voxels or a distance field for each instanced geometry, or, in files without instanced
/// geometries, for each geometry.
struct ProxyConfig {
  ProxyUse use = ProxyUse::kOff;
  uint32_t voxels = 64; ///< along the longest side of a geometry's bounds, 1..kMaxGridSize
  VoxelRule rule = VoxelRule::kConservative;
  bool fill = false;       ///< set the voxels inside closed geometries
  bool dag = false;        ///< store equal subtrees once where that takes fewer bits
  bool materials = false;  ///< store a swatch for each voxel; not with dag
  uint32_t field_bits = 8; ///< of a sample of a distance field, 8 or 16
};

} // namespace packtrace
