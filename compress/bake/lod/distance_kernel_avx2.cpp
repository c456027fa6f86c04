// Compiled for AVX2: nothing here may be inline in a header that others use, or they could end up calling it.
#if defined(__x86_64__)

#include "compress/bake/lod/distance_kernel_body.h"

namespace packtrace::avx2 {

void triangle_distances(const double* point, const TriangleBlock* blocks, uint64_t count, double* distances) {
  distances_to(point, blocks, count, distances);
}

} // namespace packtrace::avx2

#endif
