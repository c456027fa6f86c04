#pragma once

#include <cstdint>

namespace packtrace {

/// Four edges that may collapse, side by side: where the sum of their ends' quadrics is least. Plain, as it is compiled
/// for several processors.
struct alignas(32) EdgeBatch {
  double quadric[10][4]; ///< xx, xy, xz, yy, yz, zz, bx, by, bz, c
  double a[3][4], b[3][4];
  double keep[4];           ///< 1: a stays where it is, 2: b, 0: neither
  double point[3][4];       ///< result, whole numbers
  double cost[4], along[4]; ///< result; how far the new point is along the edge, 0 at a to 1 at b
  double lo[3], hi[3];      ///< the new point stays in this box
  bool ends_only;           ///< the new point is one of the ends
};

using PlacementKernel = void (*)(EdgeBatch& batch);
void place_edges(EdgeBatch& batch);
namespace avx2 {
void place_edges(EdgeBatch& batch);
}

} // namespace packtrace
