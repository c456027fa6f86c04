#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Triangles to be split into clusters, in an order that keeps neighbours close (a space-filling curve).
struct ClusterizeInput {
  std::span<const Triangle> vertices; ///< per triangle: vertex numbers; a cluster holds at most max_vertices of them
  std::span<const Triangle>
      points; ///< per triangle: position numbers; triangles with a common edge of them are neighbours
  std::span<const DVec3> centroids; ///< per triangle, any scale
  uint32_t vertex_count = 0;
  uint32_t point_count = 0;
};

/// Clusters as runs of `order`: cluster i is order[ends[i-1] .. ends[i]).
struct Clusters {
  std::vector<uint32_t> order; ///< all triangles
  std::vector<uint32_t> ends;
};

/// Greedy growth: each cluster starts at the first triangle not taken and takes the neighbour that adds the fewest
/// vertices and lies nearest, until it holds 128 triangles or 256 vertices. Where no neighbour is left before it is
/// nine tenths full, it goes on at the next triangle not taken. Time is linear in the number of triangles.
Clusters clusterize(const ClusterizeInput& input);

} // namespace packtrace
