#pragma once

#include <cstdint>
#include <span>

#include "compress/bake/lod/simplify/simplify.h"
#include "compress/bake/lod/bound/surface_bound.h"
#include "compress/bake/lod/bound/triangle_history.h"

namespace packtrace {

/// A group before simplify() and where it is found after.
struct DirectBoundInput {
  const LevelTriangles& levels;
  LatticePoint center; ///< of the group: where its coordinates begin
  std::span<const DVec3> points;
  std::span<const LodTriangle> triangles;
  std::span<const uint32_t> numbers; ///< of those triangles among those of all levels
  double floor = 0.0;                ///< the group's error need not be below
  bool dropped = false;              ///< whether loose pieces were dropped
};

/// Makes errors of the triangles after smaller where they follow from distances that add up over levels: the worst are
/// measured against the triangles of a few levels below, both ways, as long as that makes the largest smaller.
///
/// What a triangle of the group stands for lies on those triangles below that it goes back to, no further from it than
/// its error: they are cut to that, and laid over the surface after. Triangles after are laid over those below that
/// all triangles linked to them go back to.
/// @param links as bound_errors() found them, in numbers of what is left of the mesh; bounds not below what errors say.
/// Some more are added.
void bound_directly(const DirectBoundInput& input, SimplifyMesh& mesh, SurfaceLinks& links);

} // namespace packtrace
