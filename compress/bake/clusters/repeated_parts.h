#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/clusters/quantized_geometry.h"

namespace packtrace {

/// A part of a mesh whose triangles are connected as in another part, and its clusters.
struct RepeatedPart {
  std::vector<uint32_t> triangles; ///< indices into QuantizedGeometry::triangles, cluster by cluster, in strip order
  std::vector<uint32_t> ends;      ///< per cluster: end of its triangles
};

/// Finds parts of a mesh that repeat, such as the chairs of a room: components with equal connectivity in file order.
/// The first of them is cut into clusters. The others are divided into clusters of the corresponding triangles, in the
/// same order. So a compressed page stores their topology once, and coordinates once along each axis in which a part is
/// only moved.
/// Parts are listed by connectivity, then by the size of their boxes, because copies that are not rotated have equal
/// sizes. Left out are parts of fewer than 32 or more than 2^14 triangles, and those for which the clusters of the
/// first are much larger than for itself.
/// @param taken per triangle: 1 if it belongs to another cluster; parts are equal only if equal triangles are taken
std::vector<RepeatedPart> find_repeated_parts(const QuantizedGeometry& geometry, std::span<const uint8_t> taken);

} // namespace packtrace
