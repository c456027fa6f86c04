#include "compress/bake/lod/edge_placement_body.h"

namespace packtrace {

void place_edges(EdgeBatch& batch) { place_four(batch); }

} // namespace packtrace
