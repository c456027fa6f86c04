#pragma once

#include <cstdint>

namespace packtrace {

/// Four triangles: a corner and the two sides that leave it. Plain, as it is compiled for several processors.
struct alignas(32) TriangleBlock {
  double a[3][4], ab[3][4], ac[3][4];
};

/// Distances of a point from the nearest points of 4 * `count` triangles. Those without area are the segments that they
/// are.
using DistanceKernel = void (*)(const double* point, const TriangleBlock* blocks, uint64_t count, double* distances);
void triangle_distances(const double* point, const TriangleBlock* blocks, uint64_t count, double* distances);
namespace avx2 {
void triangle_distances(const double* point, const TriangleBlock* blocks, uint64_t count, double* distances);
}

} // namespace packtrace
