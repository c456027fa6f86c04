#include "compress/bake/lod/simplify/edge_placement_body.h"

namespace packtrace {

void place_edges(const CollapsePoint* points, const PlacementRules& rules, const EdgeEnds* edges, uint64_t count,
                 EdgePlacement* out) {
  place_all(points, rules, edges, count, out);
}

} // namespace packtrace
