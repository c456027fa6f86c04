// Compiled for AVX2: nothing here may be inline in a header that others use, or they could end up calling it.
#if defined(__x86_64__)

#include "compress/bake/lod/simplify/edge_placement_body.h"

namespace packtrace::avx2 {

void place_edges(const CollapsePoint* points, const PlacementRules& rules, const EdgeEnds* edges, uint64_t count,
                 EdgePlacement* out) {
  place_all(points, rules, edges, count, out);
}

} // namespace packtrace::avx2

#endif
