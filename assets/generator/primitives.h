#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string_view>
#include <vector>

#include "assets/generator/model.h"
#include "assets/generator/placement.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace::scenegen {

/// Building blocks of meshes. Each appends to `mesh`; `frame` takes the block's own space to the model's.
/// Geometric normals, cross(p1 - p0, p2 - p0), point out of closed blocks.

uint32_t add_vertex(Mesh& mesh, DVec3 position);
void add_triangle(Mesh& mesh, DVec3 a, DVec3 b, DVec3 c);
/// Planar quad; its normal is that of triangle abc.
void add_quad(Mesh& mesh, DVec3 a, DVec3 b, DVec3 c, DVec3 d);
/// Quad over existing vertices. Halves without area, two of whose corners coincide, are left out.
void add_quad(Mesh& mesh, uint32_t a, uint32_t b, uint32_t c, uint32_t d);

/// Axis-aligned box in the frame: 8 vertices, 12 triangles.
void add_box(Mesh& mesh, const DAffine& frame, DVec3 lo, DVec3 hi);
/// Box between two corners of the plan, whose top is shrunk by `taper` (1: none) about its centre.
void add_tapered_box(Mesh& mesh, const DAffine& frame, DVec3 lo, DVec3 hi, double taper);

/// Surface of revolution about the frame's y axis; profile points are (radius, y) from bottom to top. Radius 0 at an
/// end closes it there. @param sides at least 3
void add_lathe(Mesh& mesh, const DAffine& frame, std::span<const glm::dvec2> profile, uint32_t sides);

/// Round bar along a path, closed at both ends with fans. @param radii one per path point
void add_tube(Mesh& mesh, std::span<const DVec3> path, std::span<const double> radii, uint32_t sides);
void add_rod(Mesh& mesh, DVec3 from, DVec3 to, double radius, uint32_t sides);

/// Sphere of 6 * cells^2 quads pushed along its radius by displacement(unit direction), both times the frame.
void add_blob(Mesh& mesh, const DAffine& frame, uint32_t cells, const std::function<double(DVec3)>& displacement);

/// A pointed leaf folded along its mid-rib: 4 vertices, 2 triangles.
/// @param direction from stalk to tip, its length is the leaf's; @param side across, its length is half the width
void add_leaf(Mesh& mesh, DVec3 stalk, DVec3 direction, DVec3 side);

/// Joins quads over a common set of points into the flat parts of a model; each part stores the points it uses once.
class PatchBuilder {
public:
  PatchBuilder(Model& model, std::span<const DVec3> points) : model_(model), points_(points) {}
  /// Point numbers around the quad.
  void quad(std::string_view material, const std::array<size_t, 4>& corners);

private:
  Model& model_;
  std::span<const DVec3> points_;
  std::map<const Mesh*, std::vector<uint32_t>> vertex_of_point_;
};

/// Area-weighted vertex normals from the triangles that share each vertex.
void compute_normals(Mesh& mesh);

} // namespace packtrace::scenegen
