#pragma once

#include <span>

#include "compress/bake/clusters/clusterize.h"
#include "compress/format/trees/box_tree.h"

namespace packtrace {

/// Cuts a tree over triangles into clusters of at most 128 triangles and 256 vertices: the largest subtrees that fit,
/// with neighbouring subtrees merged from left to right while they fit. Splits follow the surface area heuristic, so
/// that rays hit few clusters' bounds. The triangles of a cluster need not be connected. Takes O(n log n) time on the
/// calling thread.
/// @param boxes bounds of the triangles
/// @param vertices vertex numbers of the triangles, below vertex_count
Clusters cut_clusters(std::span<const TreeBox> boxes, std::span<const Triangle> vertices, uint32_t vertex_count);

} // namespace packtrace
