#pragma once

#include "compress/bake/grid/geometry_grid.h"
#include "compress/bake/grid/picture_bounds.h"

namespace packtrace {

/// What a lattice does to the sample of a geometry, weighted by the pixels that it covers.
struct GridCheck {
  double collapsed = 0.0;         ///< share of the image that triangles cover which lose their area
  double mean_tilt_degrees = 0.0; ///< between source and decoded facets that keep an area
  double tilt_degrees = 0.0;      ///< the same, of the 99 % that tilt least
  double moved = 0.0;             ///< largest distance along an axis between decoded and source positions, as floats
};

/// Geometry that no camera sees is weighted by area; nothing of the image then collapses.
GridCheck check_grid(const GeometryView& view, const GeometryGrid& grid);

} // namespace packtrace
