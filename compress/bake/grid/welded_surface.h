#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/plan/geometry_plan.h"
#include "compress/format/cluster/position_grid.h"

namespace packtrace {

/// Source positions of a geometry, in geometry space.
class SourcePoints {
public:
  SourcePoints(const Scene& scene, const GeometryPlan& plan) {
    parts_.reserve(plan.parts.size());
    for (const GeometryPart& part : plan.parts)
      parts_.push_back({PartMap(part), std::span(scene.meshes[part.mesh].positions)});
  }

  /// @param part number of the plan's part
  /// @param vertex vertex number in the part's mesh
  DVec3 operator()(size_t part, uint32_t vertex) const { return parts_[part].place(parts_[part].positions[vertex]); }

  /// Whether two vertices have the same position as floats. One point of the source may differ in the last bits of
  /// doubles.
  bool same(size_t part_a, uint32_t a, size_t part_b, uint32_t b) const {
    return Vec3((*this)(part_a, a)) == Vec3((*this)(part_b, b));
  }

private:
  struct Part {
    PartMap place;
    std::span<const Vec3> positions;
  };
  std::vector<Part> parts_;
};

/// One part of a geometry on the lattice.
struct LatticePart {
  std::vector<LatticePoint> points; ///< per vertex of the mesh
  std::vector<Triangle> triangles;  ///< indices into points, with the file's winding
};

/// The triangles of a geometry over distinct positions.
struct WeldedSurface {
  std::vector<LatticePoint> positions; ///< distinct positions of the triangles that remain, in order of first use
  std::vector<SourceVertex> sources;   ///< per position: a vertex there; empty unless the geometry deforms
  std::vector<uint8_t> merged;         ///< per position: whether distinct source points were rounded to it
  std::vector<Triangle> corners; ///< per triangle of all parts in order: indices into positions; undefined if collapsed
  std::vector<uint8_t> collapsed; ///< per triangle: it has no area and is removed (find_collapsed())
  std::vector<uint64_t> left;     ///< per part: number of triangles that remain
  uint64_t collapsed_count = 0;
  double source_area = 0.0;    ///< geometry space
  double collapsed_area = 0.0; ///< source area of the removed triangles
};

/// Welds positions and finds triangles without area. In a geometry that deforms, only vertices on the same path are
/// welded, and only triangles with two corners on the same path have no area. Depends on the input only, not on the
/// thread count.
WeldedSurface weld_surface(const Scene& scene, const GeometryPlan& plan, std::span<const LatticePart> parts);

} // namespace packtrace
