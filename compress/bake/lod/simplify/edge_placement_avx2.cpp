// Compiled for AVX2. Must not include headers with inline functions that other translation units use: the linker could
// pick the AVX2 version for them.
#if defined(__x86_64__)

#include "compress/bake/lod/simplify/edge_placement_body.h"

namespace packtrace::avx2 {

void place_edges(const CollapsePoint* points, const PlacementRules& rules, const EdgeEnds* edges, uint64_t count,
                 EdgePlacement* out) {
  place_all(points, rules, edges, count, out);
}

} // namespace packtrace::avx2

#endif
