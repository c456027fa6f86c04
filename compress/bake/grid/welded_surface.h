#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/plan/geometry_plan.h"
#include "compress/format/cluster/position_grid.h"

namespace packtrace {

/// Positions of a geometry's source, in geometry space.
class SourcePoints {
public:
  SourcePoints(const Scene& scene, const GeometryPlan& plan) : scene_(scene), plan_(plan) {}

  /// @param part of the plan
  /// @param vertex of the part's mesh
  DVec3 operator()(size_t part, uint32_t vertex) const {
    const GeometryPart& p = plan_.parts[part];
    return transform_point(p.geometry_from_mesh, DVec3(scene_.meshes[p.mesh].positions[vertex]));
  }

  /// Whether two vertices are one point as floats: what the source has as one may differ in the last bits of doubles.
  bool same(size_t part_a, uint32_t a, size_t part_b, uint32_t b) const {
    return Vec3((*this)(part_a, a)) == Vec3((*this)(part_b, b));
  }

private:
  const Scene& scene_;
  const GeometryPlan& plan_;
};

/// One part of a geometry on the lattice.
struct LatticePart {
  std::vector<LatticePoint> points; ///< by vertex of the mesh
  std::vector<Triangle> triangles;  ///< into points, winding as in the file
};

/// The triangles of a geometry over distinct positions.
struct WeldedSurface {
  std::vector<LatticePoint> positions; ///< distinct; those of triangles that stay, in the order in which they come
  std::vector<uint8_t> merged;         ///< per position: whether points that are apart in the source fell on it
  std::vector<Triangle> corners;       ///< per triangle of all parts in order, into positions; undefined where it goes
  std::vector<uint8_t> collapsed;      ///< per triangle: it has no area and goes (find_collapsed())
  std::vector<uint64_t> left;          ///< per part: triangles that stay
  uint64_t collapsed_count = 0;
  double source_area = 0.0;    ///< geometry space
  double collapsed_area = 0.0; ///< in the source, of those that go
};

/// Welds positions and finds what has no area. Depends on its input only, not on the thread count.
WeldedSurface weld_surface(const Scene& scene, const GeometryPlan& plan, std::span<const LatticePart> parts);

} // namespace packtrace
