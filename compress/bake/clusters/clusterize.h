#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Triangles to split into clusters, ordered along a space-filling curve so that neighbours are close.
struct ClusterizeInput {
  std::span<const Triangle> vertices; ///< per triangle: vertex numbers; limits the vertices of a cluster
  std::span<const Triangle> points;   ///< per triangle: position numbers; triangles that share an edge are neighbours
  std::span<const DVec3> centroids;   ///< per triangle, in any scale
  uint32_t vertex_count = 0;
  uint32_t point_count = 0;
};

/// Clusters as runs of `order`: cluster i is order[ends[i-1]..ends[i]).
struct Clusters {
  std::vector<uint32_t> order; ///< all triangle numbers
  std::vector<uint32_t> ends;
};

/// Grows clusters greedily. Each cluster starts at the first free triangle and repeatedly takes the neighbour that adds
/// the fewest vertices and is nearest, until it holds 128 triangles or 256 vertices. If it runs out of neighbours
/// before it is nine tenths full, it continues at the next free triangle. Time is linear in the number of triangles.
Clusters clusterize(const ClusterizeInput& input);

} // namespace packtrace
