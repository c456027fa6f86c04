#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "compress/bake/proxies/triangle_voxels.h"
#include "compress/format/file/baked_file.h"

namespace packtrace {

/// A triangle as it occludes.
struct OccludingTriangle {
  std::array<LatticePoint, 3> corners; ///< lattice steps, relative to OccludingTriangles::low
  std::array<Vec2, 3> uvs{};           ///< only if masks
  uint32_t slot = 0;
  bool masked = false;
};

/// The triangles of a geometry that occlude, on its lattice.
struct OccludingTriangles {
  std::vector<OccludingTriangle> triangles;
  LatticePoint low{};    ///< of their bounds
  LatticePoint extent{}; ///< of their bounds, steps
  double step = 1.0;     ///< object units
  bool closed = false;   ///< every edge has an even number of triangles, and none is masked
};

/// Collects them. A triangle occludes if it does in any of the geometry's instances.
/// @param runs first material slots of the geometry's instances, as material_runs() gives them
OccludingTriangles occluding_triangles(const BakedFile& file, uint32_t geometry, std::span<const uint32_t> runs);

/// Whether a mask of the triangle's material leaves some of it within a cube.
/// @param lo, edge of the cube, in steps relative to OccludingTriangles::low
bool opaque_within(const BakedFile& file, std::span<const uint32_t> runs, const OccludingTriangle& triangle, DVec3 lo,
                   double edge);

} // namespace packtrace
