#pragma once

#include <cstdint>
#include <span>

#include "compress/bake/clusters/clusterize.h"
#include "compress/bake/clusters/quantized_geometry.h"
#include "compress/format/trees/box_tree.h"

namespace packtrace {

/// Bounds of a triangle, in lattice steps from the geometry's origin.
TreeBox box_of(const QuantizedGeometry& geometry, uint32_t triangle);

/// Cuts some triangles of a geometry into clusters as cut_clusters() does. Clusters::order counts in `triangles`.
Clusters cut_triangles(const QuantizedGeometry& geometry, std::span<const uint32_t> triangles);

} // namespace packtrace
