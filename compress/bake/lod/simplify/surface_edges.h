#pragma once

#include <cstdint>
#include <vector>

#include "compress/bake/lod/simplify/edge_placement.h"
#include "compress/bake/lod/simplify/simplify.h"

namespace packtrace {

/// The edges of a surface, and what it costs its points to move.
struct SurfaceEdges {
  std::vector<EdgeEnds> ends;        ///< a < b
  std::vector<uint32_t> side_edge;   ///< per 3 * triangle + corner: the edge from there to the next corner
  std::vector<CollapsePoint> points; ///< quadrics of all that meets there
  std::vector<DVec3> area_normals;   ///< per triangle, twice its area long
};

/// Edges are numbered in the order in which triangles' sides have them. Quadrics are those of triangles' planes,
/// weighted by area, and of planes through borders and seams, upright on the surface.
SurfaceEdges find_surface_edges(const SimplifyMesh& mesh, const SimplifyConfig& config);

} // namespace packtrace
