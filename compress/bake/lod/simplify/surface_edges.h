#pragma once

#include <cstdint>
#include <vector>

#include "compress/bake/lod/simplify/edge_placement.h"
#include "compress/bake/lod/simplify/simplify.h"

namespace packtrace {

/// Minimum cosine between the layers of a sheet.
inline constexpr double kFolded = 0.9999;

/// The edges of a surface and the quadrics of its points.
struct SurfaceEdges {
  std::vector<EdgeEnds> ends;        ///< a < b
  std::vector<uint32_t> side_edge;   ///< at 3 * triangle + corner: the edge from that corner to the next
  std::vector<CollapsePoint> points; ///< with the sum of the quadrics around each point
  std::vector<DVec3> area_normals;   ///< per triangle; length is twice its area
};

/// Finds the edges, numbered by first use in the triangles. Quadrics are sums of the triangles' planes, weighted by
/// area, and of planes through borders and seams, perpendicular to the surface.
SurfaceEdges find_surface_edges(const SimplifyMesh& mesh, const SimplifyConfig& config);

} // namespace packtrace
