#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/exchange/vertex16/vertex16_format.h"
#include "compress/format/cluster/lattice_box.h"
#include "compress/format/file/baked_file.h"

namespace packtrace {

/// One geometry in vertex16 form. Draws count indices from the first index of this geometry.
struct Vertex16Geometry {
  vertex16::GeometryRecord record{}; ///< first_vertex and first_draw are 0
  std::vector<glm::uvec4> vertices;
  std::vector<uint32_t> indices; ///< indices into vertices
  std::vector<vertex16::DrawRecord> draws;
};

/// Lattice bounds of all vertices of the geometry.
LatticeBox lattice_box(const BakedFile& file, uint32_t geometry);

/// Divides by 2^shift and rounds to the nearest integer, halves upwards.
constexpr int64_t coarser_lattice(int64_t coordinate, uint32_t shift) {
  return shift == 0 ? coordinate : (coordinate + (int64_t{1} << (shift - 1))) >> shift;
}

/// Smallest number of low bits to drop so that the box fits 21-bit fields relative to an int32_t origin.
uint32_t vertex16_shift(const LatticeBox& box);

/// Re-encodes a geometry: merges clusters by material slot, welds vertices and measures all errors against the decoded
/// baked file.
/// @param runs where the geometry's runs of material slots begin (material_runs())
/// @param shift at least vertex16_shift() of the geometry's lattice box
/// Throws Error(kLimitExceeded) if the step exceeds the float range.
Vertex16Geometry make_vertex16_geometry(const BakedFile& file, uint32_t geometry, std::span<const uint32_t> runs,
                                        uint32_t shift);

} // namespace packtrace
