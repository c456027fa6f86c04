#pragma once

#include <cstdint>
#include <span>

#include "compress/bake/lod/bound/surface_bound.h"
#include "compress/bake/lod/bound/triangle_history.h"
#include "compress/bake/lod/simplify/simplify.h"

namespace packtrace {

/// A group before simplify(), with what is needed to trace it back to lower levels.
struct DirectBoundInput {
  const LevelTriangles& levels;
  LatticePoint center; ///< origin of the group's coordinates
  std::span<const DVec3> points;
  std::span<const LodTriangle> triangles;
  std::span<const uint32_t> numbers; ///< per triangle: its number in `levels`
  double floor = 0.0;                ///< lower limit of the group's error
  bool dropped = false;              ///< whether drop_loose_pieces() dropped any
};

/// Tightens the errors of simplified triangles where distances of several levels add up to more than the true distance.
/// The triangles with the largest errors are measured directly against the triangles of up to TriangleHistory::kDepth
/// lower levels, in both directions, while that lowers the largest error.
///
/// The part of the original surface that a source triangle represents lies within the triangle's error on the
/// lower-level triangles that it goes back to (TriangleHistory). These are clipped to that neighbourhood and overlaid
/// on the simplified surface. Simplified triangles are measured against all lower-level triangles that their linked
/// source triangles go back to.
/// @param mesh the simplified mesh; its triangle errors are updated
/// @param links from bound_errors(), with `simplified` numbering the triangles left in the mesh and bounds that include
/// the errors of dropped pieces; more links are appended
void bound_directly(const DirectBoundInput& input, SimplifyMesh& mesh, SurfaceLinks& links);

} // namespace packtrace
