#include "compress/bake/lod/distance_kernel_body.h"

namespace packtrace {

void triangle_distances(const double* point, const TriangleBlock* blocks, uint64_t count, double* distances) {
  distances_to(point, blocks, count, distances);
}

} // namespace packtrace
