#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/format/cluster/position_grid.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Whether a triangle has an area: its corners are distinct and not on one line. Exact for |coordinate| <= kMaxLattice.
bool has_area(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c);

/// Marks the triangles without area that can be left out without opening a crack, one flag per triangle.
///
/// A triangle with two equal corners can always go: its other two edges are one edge, at which its neighbours meet. A
/// sliver of three points on one line cannot where one neighbour has the long edge and two others the short ones: rays
/// are tested against rounded vertices, so without the sliver some would pass between them. Slivers that meet at edges
/// are one piece, and all of it goes where at most one edge of its outline (the edges that an odd number of its
/// triangles has) belongs to a triangle with area.
/// @param points distinct, at least those of the triangles
/// @param triangles into points
std::vector<uint8_t> find_collapsed(std::span<const LatticePoint> points, std::span<const Triangle> triangles);

} // namespace packtrace
