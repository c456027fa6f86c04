#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/format/cluster/position_grid.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Whether the corners of a triangle are distinct and not on one line. Exact for |coordinate| <= kMaxLattice.
bool has_area(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c);

/// Flags the triangles without area that can be removed without opening a crack, one flag per triangle.
///
/// A triangle with two equal corners can always be removed: its other two edges coincide, so its neighbours meet there.
/// A sliver, with three distinct corners on one line, cannot be removed if one neighbour shares its long edge and two
/// others its short edges: rays are tested against rounded vertices, so some would pass between them. Slivers that
/// share edges form one piece. A piece is removed if at most one edge of its outline belongs to a triangle with area;
/// the outline consists of the edges that an odd number of its triangles have.
/// @param points distinct; includes at least the corners of the triangles
/// @param triangles indices into points
std::vector<uint8_t> find_collapsed(std::span<const LatticePoint> points, std::span<const Triangle> triangles);

} // namespace packtrace
