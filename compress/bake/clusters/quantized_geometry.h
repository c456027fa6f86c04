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

/// A vertex after quantisation; vertices are distinct.
struct QuantizedVertex {
  uint32_t position = 0;    ///< into QuantizedGeometry::positions
  uint32_t normal_code = 0; ///< of QuantizedGeometry::normal_encoding; 0 at corners of flat triangles
  UvLattice uv{};           ///< 0 where the material needs none
  bool operator==(const QuantizedVertex&) const = default;
};

/// Triangles that share a material slot and the streams they need.
struct TriangleKind {
  uint32_t slot = 0;
  bool flat = false; ///< all normals are the face normal: none are stored
  bool uvs = false;
  bool operator==(const TriangleKind&) const = default;
};

/// What quantising did to a geometry.
struct QuantizeStats {
  uint64_t source_vertices = 0;
  uint64_t distinct_vertices = 0;
  uint64_t collapsed_triangles = 0;  ///< have no area on the lattice and are left out (find_collapsed())
  uint64_t coinciding_triangles = 0; ///< are left out as they became equal to another one (CoincidingTriangles)
  double source_area = 0.0;          ///< of all triangles of the source, geometry space
  double collapsed_area = 0.0;       ///< in the source, of collapsed ones
  std::vector<uint64_t> left;        ///< triangles by part, without those left out
  uint64_t flat_triangles = 0;       ///< whose meshes have normals that need not be stored
  uint64_t inferred_normals = 0;     ///< of the source that only such triangles have
  uint64_t repaired_normals = 0;     ///< were zero, or became so under a flattening transform
  uint64_t replaced_uvs = 0;         ///< were not finite
  double max_position_error = 0.0;   ///< largest axis
  double max_normal_error_degrees = 0.0;
  double normal_error_sum = 0.0;    ///< degrees
  uint64_t normal_count = 0;        ///< in normal_error_sum
  double max_uv_error = 0.0;        ///< larger axis
  double max_uv_error_texels = 0.0; ///< of the finest texture that is looked up
};

/// One geometry on its lattice: welded, wound for the file, in the order of its parts.
struct QuantizedGeometry {
  PositionGrid grid;
  NormalEncoding normal_encoding = NormalEncoding::kAxis16;
  UvEncoding uv_encoding = UvEncoding::kLattice;
  std::array<int32_t, 2> uv_exponent{};
  LatticePoint origin{};     ///< smallest coordinates
  uint32_t anchor_shift = 0; ///< so that extents >> anchor_shift fit int32_t
  std::vector<LatticePoint> positions;
  std::vector<QuantizedVertex> vertices;
  std::vector<Triangle> triangles;  ///< into vertices
  std::vector<TriangleKind> kinds;  ///< distinct
  std::vector<uint32_t> kind_of;    ///< per triangle, into kinds
  std::vector<uint32_t> slots;      ///< of the plan that have triangles left: one for each slot here
  std::vector<uint32_t> slot_class; ///< material class by slot, ascending

  QuantizeStats stats;
};

/// Throws Error(kLimitExceeded) where the lattice is too large for its limit, or a measured error exceeds
/// position_error_bound() or config.normal_limits(), or a texture coordinate is beyond config.uvs;
/// Error(kInput) for normals that are not finite.
/// @param measure of the plan's geometry (measure_geometry()); its median edge is the one that normal_limits() asks for
QuantizedGeometry quantize_geometry(const Scene& scene, const GeometryPlan& plan, const GeometryNeeds& needs,
                                    const BakeConfig& config, const GeometryGrid& grid, const GeometryMeasure& measure);

} // namespace packtrace
