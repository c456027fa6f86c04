// Compiled for AVX2. Must not include headers with inline functions that other translation units use: the linker could
// pick the AVX2 version for them.
#if defined(__x86_64__)

#include "compress/bake/lod/bound/distance_kernel_body.h"

namespace packtrace::avx2 {

void triangle_distances(const double* points, uint64_t point_count, const TriangleBlock* blocks, uint64_t count,
                        double* const* distances) {
  distances_to(points, point_count, blocks, count, distances);
}

NearestTriangle nearest_triangle(const double* a, const double* b, const double* c, uint64_t count) {
  return nearest_of(a, b, c, count);
}

} // namespace packtrace::avx2

#endif
