#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "compress/bake/clusters/quantized_geometry.h"
#include "compress/bake/clusters/repeated_clusters.h"
#include "compress/format/cluster/index_codec.h"

namespace packtrace {

/// A cluster-sized rectangle of a regular grid of quads (a GridBlock). If the diagonals of all quads are equal or
/// alternate, all blocks of one size have equal strips, which a compressed page stores once.
struct RegularBlock {
  uint32_t triangle_count = 0;
  std::array<uint32_t, kMaxClusterTriangles> triangles;   ///< indices into QuantizedGeometry::triangles, in strip order
  std::array<uint8_t, kMaxClusterTriangles> first_corner; ///< per triangle: number of its corner that becomes the first

  /// Returns the vertices of triangle k of the block, beginning with its first corner.
  Triangle triangle(const QuantizedGeometry& geometry, size_t k) const {
    const Triangle& t = geometry.triangles[triangles[k]];
    const int first = first_corner[k];
    return {t[first], t[(first + 1) % 3], t[(first + 2) % 3]};
  }
};

/// Finds disjoint blocks in the regular parts of a mesh, where six triangles meet at every vertex, or alternately four
/// and eight. If these hold less than half of the triangles, but three quarters are about right-angled, also looks for
/// quads whose diagonals are the longest edges of their triangles, and returns the blocks that hold more triangles. The
/// blocks of a grid are in row order.
/// @param which kMany or kMost
std::vector<RegularBlock> find_regular_blocks(const QuantizedGeometry& geometry, RepeatedClusters which);

} // namespace packtrace
