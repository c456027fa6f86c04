#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "compress/bake/grid/geometry_grid.h"
#include "compress/bake/plan/geometry_plan.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// One mesh of one instance. Its triangles have consecutive numbers among all placed triangles.
struct PlacedPart {
  uint32_t geometry;
  const GeometryPart* part;
  DAffine world_from_geometry;
  uint32_t first_triangle;
  PartMap geometry_from_mesh; ///< of `part`
  bool placed;                ///< world_from_geometry is not the identity
  double step;                ///< of the geometry's coarsest lattice, world units

  /// Geometry space position of a vertex of the mesh.
  DVec3 in_geometry(Vec3 p) const { return geometry_from_mesh(p); }
  DVec3 in_world(Vec3 p) const { return placed ? transform_point(world_from_geometry, DVec3(p)) : DVec3(p); }
};

/// The camera-visible triangles of chosen instances in world space, with their source positions and with positions on
/// the lattices.
class PlacedParts {
public:
  /// @param instances indices of the instances
  /// @param grids per geometry: the lattice to which positions are rounded
  /// The arguments must outlive this object.
  PlacedParts(const Scene& scene, const ScenePlan& plan, std::span<const uint32_t> instances,
              std::span<const GeometryGrid> grids);

  std::span<const PlacedPart> parts() const { return parts_; }
  uint32_t triangle_count() const { return triangles_; }
  const Mesh& mesh_of(const PlacedPart& placed) const { return scene_.meshes[placed.part->mesh]; }
  /// Returns the part that contains a triangle. `triangle` is its number among all placed triangles.
  const PlacedPart& part_of(uint32_t triangle) const;

  /// World position of a vertex, rounded to a float in geometry space.
  DVec3 source_position(const PlacedPart& placed, uint32_t vertex) const {
    return placed.in_world(Vec3(placed.in_geometry(mesh_of(placed).positions[vertex])));
  }
  /// World position of a vertex on the lattice, as the file's readers decode it.
  DVec3 rounded_position(const PlacedPart& placed, uint32_t vertex) const;

  using Position = DVec3 (PlacedParts::*)(const PlacedPart&, uint32_t vertex) const;
  /// World positions of a triangle's corners. `triangle` is its number among all placed triangles.
  std::array<DVec3, 3> corners(uint32_t triangle, Position position) const;

private:
  const Scene& scene_;
  const std::span<const GeometryGrid> grids_;
  std::vector<PlacedPart> parts_; // by first_triangle
  uint32_t triangles_ = 0;
};

} // namespace packtrace
