#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/format/file/baked_file.h"
#include "compress/format/cluster/lattice_box.h"
#include "compress/exchange/vertex16/vertex16_format.h"

namespace packtrace {

/// One geometry as vertex16 has it. Draws count indices from the first of this geometry.
struct Vertex16Geometry {
  vertex16::GeometryRecord record{}; ///< first_vertex and first_draw are left 0
  std::vector<glm::uvec4> vertices;
  std::vector<uint32_t> indices; ///< into vertices
  std::vector<vertex16::DrawRecord> draws;
};

/// Of all vertices of the geometry.
LatticeBox lattice_box(const BakedFile& file, uint32_t geometry);

/// The nearest multiple of 2^shift, divided by it; halves go up.
constexpr int64_t coarser_lattice(int64_t coordinate, uint32_t shift) {
  return shift == 0 ? coordinate : (coordinate + (int64_t{1} << (shift - 1))) >> shift;
}

/// The least number of bits that coordinates must lose for the box to fit 21-bit fields over an int32 origin.
uint32_t vertex16_shift(const LatticeBox& box);

/// Clusters merged by material slot, vertices welded, everything re-encoded and measured against what the file decodes
/// to.
/// @param runs where the geometry's runs of material slots begin (material_runs())
/// @param shift at least vertex16_shift() of its box
/// Throws Error(kLimitExceeded) where the step leaves the range of floats.
Vertex16Geometry make_vertex16_geometry(const BakedFile& file, uint32_t geometry, std::span<const uint32_t> runs,
                                        uint32_t shift);

} // namespace packtrace
