#pragma once

#include <vector>

#include "compress/bake/grid/placed_parts.h"
#include "compress/bake/grid/visible_surface.h"

namespace packtrace {

/// Measures how lattices change the narrow gaps in which visible surfaces lie. There, ambient occlusion depends on the
/// gap's width and on the place, so it changes although every edge stays in its pixel. A gap ends at the nearest
/// triangle that the surface's normal hits within 32 steps and a 32nd of the visible points' extent, if that triangle
/// faces the surface within 45 degrees.
/// @return per pixel: (|change of the gap's width| + |movement of the visible point along the surface|) / width, at
/// most
///   1. 0 without a gap, and NaN for pixels that were left out to bound the time (every k-th one is measured). Does not
///   depend on the thread count.
std::vector<float> measure_gap_changes(const PlacedParts& parts, const VisiblePoints& points);

} // namespace packtrace
