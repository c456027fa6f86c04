#pragma once

#include <cstdint>

#include <vector>

#include "compress/bake/lod/simplify/simplify.h"

namespace packtrace {

/// When drop_loose_pieces() stops.
struct DropTargets {
  uint32_t triangles = 0; ///< stops once this many triangles are left
  /// Pieces that cost more than a few times the input's largest error are dropped only while more triangles than this
  /// are left. Other expensive pieces remain for coarser levels.
  uint32_t at_any_cost = 0;
};

/// The representative of a triangle after the drop: the triangle itself or, if it was dropped, the one that is nearest
/// to all of it. Triangle numbers are those of the new mesh.
struct TriangleSubstitute {
  uint32_t triangle = 0;
  bool dropped = false;
  double distance = 0.0; ///< largest distance of the dropped triangle from its representative
};

/// Drops connected pieces without locked points, in order of their distance from other pieces; at least one piece
/// remains. The error of the triangle that represents a piece grows to include the distance. Returns the representative
/// of each triangle of the old mesh. Takes quadratic time in the number of pieces.
std::vector<TriangleSubstitute> drop_loose_pieces(SimplifyMesh& mesh, const DropTargets& targets);

} // namespace packtrace
