#pragma once

#include <cstdint>

#include "compress/bake/lod/simplify.h"

namespace packtrace {

/// Drops pieces of the mesh that hang together with nothing else and have no locked point, those first that lie nearest
/// to what is left, until target_triangles are left; one piece always stays. The error of a triangle near each dropped
/// piece grows to hold for it too. Time grows with the square of the number of pieces.
void drop_loose_pieces(SimplifyMesh& mesh, uint32_t target_triangles);

} // namespace packtrace
