#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "compress/exchange/gltf/plain_primitives.h"

namespace packtrace {

/// Quantisation of positions to a part of a lattice. Equal points in primitives with equal grids decode to equal bits.
struct DracoGrid {
  LatticePoint origin{}; ///< smallest coordinates on the lattice
  double step = 1.0;
  int bits = 1; ///< 1..30 per axis, the range of Draco
};

struct DracoConfig {
  int level = 7;        ///< 0 fastest .. 10 smallest
  int normal_bits = 12; ///< 2..30, octahedral
  int uv_bits = 14;     ///< 1..30, over the range of the primitive's coordinates
};

/// A primitive as KHR_draco_mesh_compression stores it.
struct DracoPrimitive {
  std::vector<std::byte> bytes;
  uint32_t points = 0, faces = 0; ///< counts after decoding
  int position_id = -1, normal_id = -1, uv_id = -1;
};

/// Encodes one primitive with Draco's edgebreaker method. Draco drops triangles with coinciding corners, so `faces` may
/// be less than the number of triangles. Returns nullopt if Draco cannot encode the mesh.
/// @param primitive with at least one triangle, inside the grid
std::optional<DracoPrimitive> encode_draco(const PlainPrimitive& primitive, const DracoGrid& grid,
                                           const DracoConfig& config);

} // namespace packtrace
