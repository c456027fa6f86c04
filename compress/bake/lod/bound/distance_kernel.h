#pragma once

#include <cstdint>

namespace packtrace {

/// Four triangles: a corner and the two sides that leave it. Plain, as it is compiled for several processors.
struct alignas(32) TriangleBlock {
  double a[3][4], ab[3][4], ac[3][4];
};

/// The triangle of several that is nearest to all of another one.
struct NearestTriangle {
  uint64_t place;  ///< the first of several
  double distance; ///< at most, of all of it
  double least;    ///< some corner of it is that far from all of them: those still looked at
};

/// Distances of points from the nearest points of 4 * `count` triangles, a row for each point. Triangles without area
/// are the segments that they are.
using DistanceKernel = void (*)(const double* points, uint64_t point_count, const TriangleBlock* blocks, uint64_t count,
                                double* const* distances);
void triangle_distances(const double* points, uint64_t point_count, const TriangleBlock* blocks, uint64_t count,
                        double* const* distances);
/// What rows of distances, of the three corners of a triangle, say of it.
using NearestKernel = NearestTriangle (*)(const double* a, const double* b, const double* c, uint64_t count);
NearestTriangle nearest_triangle(const double* a, const double* b, const double* c, uint64_t count);
namespace avx2 {
void triangle_distances(const double* points, uint64_t point_count, const TriangleBlock* blocks, uint64_t count,
                        double* const* distances);
NearestTriangle nearest_triangle(const double* a, const double* b, const double* c, uint64_t count);
} // namespace avx2

} // namespace packtrace
