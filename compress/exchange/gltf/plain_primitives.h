#pragma once

#include <cstdint>
#include <vector>

#include "compress/format/file/baked_file.h"
#include "compress/format/cluster/position_grid.h"

namespace packtrace {

/// The triangles of one geometry that share a material slot and the same streams, with vertices equal in everything
/// merged across clusters.
struct PlainPrimitive {
  uint32_t material_slot = 0;
  std::vector<LatticePoint> lattice; ///< of each vertex
  std::vector<Vec3> positions;       ///< the same, decoded
  std::vector<Vec3> normals;         ///< unit; empty: flat
  std::vector<Vec2> uvs;             ///< empty: none
  std::vector<Triangle> triangles;
};

/// In order of their first cluster.
std::vector<PlainPrimitive> plain_primitives(const BakedFile& file, uint32_t geometry);

} // namespace packtrace
