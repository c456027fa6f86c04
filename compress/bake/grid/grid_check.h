#pragma once

#include "compress/bake/grid/geometry_grid.h"
#include "compress/bake/grid/picture_bounds.h"

namespace packtrace {

/// Effect of a lattice on the sample triangles of a geometry, weighted by the pixels that they cover.
struct GridCheck {
  double collapsed = 0.0;         ///< fraction of the image covered by triangles that lose their area
  double mean_tilt_degrees = 0.0; ///< angle between source and decoded facets that keep an area
  double tilt_degrees = 0.0;      ///< 99 % quantile of that angle
  double moved = 0.0; ///< largest distance along an axis between decoded and source positions, both as floats
};

/// Checks a lattice. Geometry that no camera sees is weighted by area, and `collapsed` is 0 for it.
GridCheck check_grid(const GeometryView& view, const GeometryGrid& grid);

} // namespace packtrace
