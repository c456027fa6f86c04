#pragma once

#include <cstdint>

#include "compress/bake/lod/simplify/edge_placement.h"

namespace packtrace {

/// The triangles around a point, as seen from it. Plain data, as it is compiled for several instruction sets.
struct alignas(32) PointFan {
  double directions[3]; ///< integral of the unit vectors in the triangles over their angles
  double angle;         ///< sum, in radians
};

/// Triangles and the points whose sums they are added to.
struct PlaneTask {
  const double* points; ///< x, y, z per point
  const char* corners;  ///< three point numbers, every `stride` bytes
  uint64_t stride;
  double* area_normals; ///< output: x, y, z per triangle; length is twice its area
  CollapsePoint* sums;  ///< per point: adds to `quadric` and `area`
  PointFan* fans;       ///< per point
};

/// Adds the planes of triangles, weighted by area, and their angles to the sums of their points, in order. Stops before
/// the first triangle without area, from `first` on, and returns its number, or `count` if there is none. Normals are
/// set for that one too.
using PlaneKernel = uint64_t (*)(const PlaneTask& task, uint64_t first, uint64_t count);
uint64_t add_triangle_planes(const PlaneTask& task, uint64_t first, uint64_t count);
namespace avx2 {
uint64_t add_triangle_planes(const PlaneTask& task, uint64_t first, uint64_t count);
}

} // namespace packtrace
