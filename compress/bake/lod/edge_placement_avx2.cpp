// Compiled for AVX2: nothing here may be inline in a header that others use, or they could end up calling it.
#if defined(__x86_64__)

#include "compress/bake/lod/edge_placement_body.h"

namespace packtrace::avx2 {

void place_edges(EdgeBatch& batch) { place_four(batch); }

} // namespace packtrace::avx2

#endif
