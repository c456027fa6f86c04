#pragma once

#include <vector>

#include "compress/bake/grid/placed_parts.h"
#include "compress/bake/grid/visible_surface.h"

namespace packtrace {

/// Measures how lattices change narrow gaps in front of visible surfaces. In a gap, ambient occlusion depends on the
/// gap's width and on the position in it, so it may change although no edge moves to another pixel. A gap ends at the
/// nearest of the triangles that the surface's normal hits and that face the surface within 45 degrees. It is narrow if
/// its width is at most 32 steps and 1/32 of the visible points' extent.
/// @return per pixel: min(1, (|change of the gap's width| + |movement of the visible point along the surface|) /
/// width); 0 without a narrow gap; NaN if not measured: to bound the time, only every k-th pixel may be. Does not
/// depend on the thread count.
std::vector<float> measure_gap_changes(const PlacedParts& parts, const VisiblePoints& points);

} // namespace packtrace
