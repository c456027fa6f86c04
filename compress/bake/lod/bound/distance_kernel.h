#pragma once

#include <cstdint>

namespace packtrace {

/// Four triangles, each as a corner and the two edge vectors from it. Plain data, as it is compiled for several
/// instruction sets.
struct alignas(32) TriangleBlock {
  double a[3][4], ab[3][4], ac[3][4];
};

/// The triangle of a set that is nearest to all of a given triangle.
struct NearestTriangle {
  uint64_t place;  ///< index; the lowest one if several are equally near
  double distance; ///< maximum distance of the given triangle's points from it
  double least;    ///< lower bound of the maximum distance to the whole set: some corner is that far from all
};

/// Distances of points from 4 * `count` triangles, one row per point. Degenerate triangles count as segments.
using DistanceKernel = void (*)(const double* points, uint64_t point_count, const TriangleBlock* blocks, uint64_t count,
                                double* const* distances);
void triangle_distances(const double* points, uint64_t point_count, const TriangleBlock* blocks, uint64_t count,
                        double* const* distances);
/// Finds the nearest triangle from the rows of distances of a triangle's three corners.
using NearestKernel = NearestTriangle (*)(const double* a, const double* b, const double* c, uint64_t count);
NearestTriangle nearest_triangle(const double* a, const double* b, const double* c, uint64_t count);
namespace avx2 {
void triangle_distances(const double* points, uint64_t point_count, const TriangleBlock* blocks, uint64_t count,
                        double* const* distances);
NearestTriangle nearest_triangle(const double* a, const double* b, const double* c, uint64_t count);
} // namespace avx2

} // namespace packtrace
