#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "compress/exchange/gltf/gltf_materials.h"
#include "compress/exchange/gltf/meshopt_streams.h"
#include "compress/exchange/gltf/plain_primitives.h"

namespace packtrace {

/// Grid of the texture coordinates of a whole file: codes of 16 bits, or floats.
struct UvGrid {
  glm::dvec2 origin{0.0};
  double step = 0.0; ///< 0: floats
  UvMap map() const { return step > 0.0 ? UvMap{glm::dvec2(step), origin} : UvMap{}; }
};

/// A primitive with the values that it stores: lattice points, codes of normals and texture coordinates. Vertices with
/// equal values are merged. Its triangles are a list or a strip.
struct MeshoptPrimitive {
  std::vector<LatticePoint> lattice;
  std::vector<std::array<int16_t, 4>> normals; ///< x, y, unit, 0, as the filter OCTAHEDRAL stores them
  std::vector<std::array<float, 2>> uvs;       ///< codes on the UvGrid, or floats
  std::vector<uint32_t> indices;               ///< three per triangle; empty if it is a strip
  std::vector<std::array<uint32_t, 2>> strip;  ///< pairs of indices; triangles with equal corners join its parts
  uint64_t triangles = 0;                      ///< without those that join parts of the strip
  uint64_t collapsed_triangles = 0;            ///< left out, because they have equal corners
  double max_normal_error_degrees = 0.0;
};

/// How the integers of positions are stored, so that the object-space position is step * (stored + origin).
struct PositionFrame {
  enum class Form : uint8_t { kShort, kUnsignedShort, kFloat } form = Form::kShort;
  LatticePoint origin{};
};

/// The smallest form that holds all points from lo to hi; none if their extent exceeds 24 bits.
std::optional<PositionFrame> position_frame(const LatticePoint& lo, const LatticePoint& hi);

/// Rounds the values of a primitive, merges equal vertices, and orders triangles and vertices for the codec: as a list
/// or as a strip, whichever is smaller. Both are encoded, at once if threads are free.
/// @param normal_bits 4..16
MeshoptPrimitive meshopt_primitive(const PlainPrimitive& plain, const PositionFrame& frame, int normal_bits,
                                   const UvGrid& uvs, bool keep_uvs);

/// Adds accessors for the primitive; returns the glTF primitive without a material.
GltfJson add_meshopt_primitive(const MeshoptPrimitive& primitive, const PositionFrame& frame, int normal_bits,
                               const UvGrid& uvs, MeshoptStreams& streams);

} // namespace packtrace
