#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/bake_config.h"
#include "compress/bake/grid/geometry_grid.h"
#include "compress/bake/grid/geometry_measure.h"
#include "compress/bake/plan/geometry_plan.h"
#include "compress/bake/plan/requirements.h"
#include "compress/format/cluster/uv_codec.h"

namespace packtrace {

/// A quantised vertex. Vertices are distinct.
struct QuantizedVertex {
  uint32_t position = 0;    ///< index into QuantizedGeometry::positions
  uint32_t normal_code = 0; ///< in QuantizedGeometry::normal_encoding; 0 at corners of flat triangles
  UvLattice uv{};           ///< 0 if the material needs no UVs
  bool operator==(const QuantizedVertex&) const = default;
};

/// The material slot and streams that a set of triangles has in common.
struct TriangleKind {
  uint32_t slot = 0;
  bool flat = false; ///< all normals equal the face normal, so none are stored
  bool uvs = false;
  bool operator==(const TriangleKind&) const = default;
};

/// Statistics of quantising one geometry.
struct QuantizeStats {
  uint64_t source_vertices = 0;
  uint64_t distinct_vertices = 0;
  uint64_t collapsed_triangles = 0; ///< have no area on the lattice and are left out (find_collapsed())
  /// Equal to another triangle after quantisation and left out (CoincidingTriangles).
  uint64_t coinciding_triangles = 0;
  double source_area = 0.0;    ///< of all source triangles, geometry space
  double collapsed_area = 0.0; ///< source area of the collapsed triangles
  std::vector<uint64_t> left;  ///< triangles per part, without those left out
  /// Triangles whose source normals equal the face normal within the limit, so that they are not stored.
  uint64_t flat_triangles = 0;
  uint64_t inferred_normals = 0;       ///< source normals that no triangle needs except flat ones
  uint64_t repaired_normals = 0;       ///< were zero, or became zero under a flattening transform
  uint64_t replaced_uvs = 0;           ///< were not finite
  double max_position_error = 0.0;     ///< largest over the axes
  double position_error_squares = 0.0; ///< sum of the squared errors of every vertex and axis
  uint64_t position_error_count = 0;   ///< number of errors in position_error_squares
  double max_normal_error_degrees = 0.0;
  double normal_error_sum = 0.0;    ///< degrees
  uint64_t normal_count = 0;        ///< number of normals in normal_error_sum
  double max_uv_error = 0.0;        ///< larger of the two axes
  double max_uv_error_texels = 0.0; ///< in texels of the finest texture that is looked up
};

/// One geometry on its lattice: welded, with the file's winding, in the order of its parts.
struct QuantizedGeometry {
  PositionGrid grid;
  NormalEncoding normal_encoding = NormalEncoding::kAxis16;
  UvEncoding uv_encoding = UvEncoding::kLattice;
  std::array<int32_t, 2> uv_exponent{};
  LatticePoint origin{};     ///< lower bound of the lattice coordinates
  uint32_t anchor_shift = 0; ///< smallest shift for which extents >> anchor_shift fit int32_t
  std::vector<LatticePoint> positions;
  std::vector<SourceVertex> sources; ///< per position; empty unless the geometry deforms
  std::vector<QuantizedVertex> vertices;
  std::vector<Triangle> triangles;  ///< indices into vertices
  std::vector<TriangleKind> kinds;  ///< distinct kinds
  std::vector<uint32_t> kind_of;    ///< per triangle: index into kinds
  std::vector<uint32_t> slots;      ///< slots of the plan that still have triangles; entry i becomes slot i here
  std::vector<uint32_t> slot_class; ///< material class per slot, ascending

  QuantizeStats stats;
};

/// Quantises and welds the geometry of a plan.
/// Throws Error(kLimitExceeded) if the lattice needs more coordinates than it may have, if a measured error exceeds
/// position_error_bound() or config.normal_limits(), or if a texture coordinate is out of the range of config.uvs;
/// Error(kInput) if a normal is not finite.
/// @param measure of the plan's geometry (measure_geometry()); its median edge sets config.normal_limits()
QuantizedGeometry quantize_geometry(const Scene& scene, const GeometryPlan& plan, const GeometryNeeds& needs,
                                    const BakeConfig& config, const GeometryGrid& grid, const GeometryMeasure& measure);

} // namespace packtrace
