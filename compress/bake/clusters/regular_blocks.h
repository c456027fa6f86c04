#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "compress/bake/clusters/quantized_geometry.h"
#include "compress/format/cluster/index_codec.h"

namespace packtrace {

/// A cluster-sized rectangle of a regular grid of quads, each cut along the same diagonal. All blocks of one size have
/// equal strips, which a compressed page stores once.
struct RegularBlock {
  uint32_t triangle_count = 0;
  std::array<uint32_t, kMaxClusterTriangles> triangles;   ///< their numbers, in the order of strips_in_order()
  std::array<uint8_t, kMaxClusterTriangles> first_corner; ///< per triangle: the corner that comes first

  /// Returns the vertices of triangle number k of the block.
  Triangle triangle(const QuantizedGeometry& geometry, size_t k) const {
    const Triangle& t = geometry.triangles[triangles[k]];
    const int first = first_corner[k];
    return {t[first], t[(first + 1) % 3], t[(first + 2) % 3]};
  }
};

/// Finds disjoint blocks in the regular parts of a mesh, where six triangles meet at a vertex. Returns none if less
/// than a quarter of the triangles are regular. Blocks next to each other in a grid mostly follow each other.
std::vector<RegularBlock> find_regular_blocks(const QuantizedGeometry& geometry);

} // namespace packtrace
