#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/clusters/quantized_geometry.h"
#include "compress/bake/plan/geometry_plan.h"
#include "compress/format/cluster/normal_codec.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// One part of a geometry on its lattice, per source vertex or triangle.
struct QuantizedPart {
  std::vector<LatticePoint> lattice;
  std::span<const uint8_t> collapsed; ///< per triangle: WeldedSurface::collapsed
  std::span<const Triangle> corners;  ///< per triangle: WeldedSurface::corners
  std::vector<DVec3> normals;         ///< unit length; empty if none are stored
  std::vector<uint8_t> smooth;        ///< per normal: used by a triangle that is not flat
  std::vector<uint32_t> codes;
  std::vector<UvLattice> uvs;
  std::vector<Triangle> triangles; ///< with the file's winding
  std::vector<uint8_t> flat;       ///< per triangle: needs no normals

  /// Whether a triangle has not collapsed.
  bool stays(size_t triangle) const { return collapsed[triangle] == 0; }
};

/// Sets the normals of a part and marks all its triangles as smooth. Zero normals become face normals.
/// Throws Error(kInput) if a normal is not finite or normals and positions differ in number.
void quantize_normals(const GeometryPart& part, const Mesh& mesh, QuantizedPart& work, QuantizeStats& stats);

/// Marks the triangles as flat whose normals at all corners are within flat_degrees of the face normal or its negative.
void find_flat_triangles(double flat_degrees, QuantizedPart& work);

/// Marks the normals that smooth triangles use, which are stored. Adds the flat triangles to the statistics, with the
/// errors of taking their face normals instead.
void find_smooth_normals(QuantizedPart& work, QuantizeStats& stats);

/// Upper bound of the bits of the encoding that choose_normal_encoding() returns.
uint32_t expected_normal_bits(double max_error_degrees);

/// Returns the encoding with the fewest bits whose largest error is within the limit; kAxis32 if there is none.
NormalEncoding choose_normal_encoding(std::span<const QuantizedPart> parts, double max_error_degrees);

/// Encodes the normals of triangles that are not flat.
void encode_normals(NormalEncoding encoding, QuantizedPart& work, QuantizeStats& stats);

/// Angle in degrees between a unit normal and a decoded code.
double normal_encoding_error(NormalEncoding encoding, DVec3 normal, uint32_t code);

} // namespace packtrace
