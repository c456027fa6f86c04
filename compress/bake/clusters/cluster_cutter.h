#pragma once

#include <span>

#include "compress/bake/clusters/clusterize.h"
#include "compress/format/trees/box_tree.h"

namespace packtrace {

/// Cuts a tree over triangles into clusters of at most 128 triangles and 256 vertices: the largest subtrees that small,
/// and neighbours from left to right together where they fit. Splits follow the surface area heuristic, so that rays
/// meet few clusters' boxes; triangles of a cluster need not hang together. Time O(n log n), on the calling thread.
/// @param boxes of the triangles
/// @param vertices of the triangles, below vertex_count
Clusters cut_clusters(std::span<const TreeBox> boxes, std::span<const Triangle> vertices, uint32_t vertex_count);

} // namespace packtrace
