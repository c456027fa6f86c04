#pragma once

#include <cstdint>

#include <vector>

#include "compress/bake/lod/simplify/simplify.h"

namespace packtrace {

/// How far drop_loose_pieces() goes.
struct DropTargets {
  uint32_t triangles = 0; ///< none goes once there are so few
  /// Those go on until so few are left that cost more than a few times the largest error that there was. Then pieces
  /// that stand alone wait for coarser levels.
  uint32_t at_any_cost = 0;
};

/// What stands for a triangle that there was: itself, or, where it was dropped, one near it. Numbers of those left.
struct TriangleStand {
  uint32_t triangle = 0;
  bool dropped = false;
};

/// Drops pieces of the mesh that hang together with nothing else and have no locked point, those first that lie nearest
/// to what is left; one piece always stays. The error of a triangle near each dropped piece grows to hold for it too.
/// Returns what stands for each triangle that there was.
/// Time grows with the square of the number of pieces.
std::vector<TriangleStand> drop_loose_pieces(SimplifyMesh& mesh, const DropTargets& targets);

} // namespace packtrace
