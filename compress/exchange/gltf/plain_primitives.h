#pragma once

#include <cstdint>
#include <vector>

#include "compress/format/cluster/position_grid.h"
#include "compress/format/file/baked_file.h"

namespace packtrace {

/// The triangles of one geometry with the same material slot and the same streams. Vertices of different clusters are
/// merged if all their values are equal.
struct PlainPrimitive {
  uint32_t material_slot = 0;
  std::vector<LatticePoint> lattice; ///< of each vertex
  std::vector<Vec3> positions;       ///< `lattice`, decoded to object space
  std::vector<Vec3> normals;         ///< unit length; empty: flat
  std::vector<Vec2> uvs;             ///< empty if there are none
  std::vector<Triangle> triangles;
};

/// Appends a primitive to one with the same streams, or to an empty one. The material slot is the first one's.
void append(PlainPrimitive& to, PlainPrimitive&& from);

/// Returns the primitives of a geometry, in order of their first cluster.
std::vector<PlainPrimitive> plain_primitives(const BakedFile& file, uint32_t geometry);

} // namespace packtrace
