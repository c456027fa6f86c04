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

inline const DAffine kHere(1.0); ///< frame of parts that stay where they are modelled

/// Building blocks of meshes. Each function appends to `mesh`; `frame` maps the block's own space to the model's.
/// Geometric normals, cross(p1 - p0, p2 - p0), point out of closed blocks.

uint32_t add_vertex(Mesh& mesh, DVec3 position);
void add_triangle(Mesh& mesh, DVec3 a, DVec3 b, DVec3 c);
/// Planar quad; its normal is that of triangle abc.
void add_quad(Mesh& mesh, DVec3 a, DVec3 b, DVec3 c, DVec3 d);
/// Quad over existing vertices. A half with two coinciding corners is left out.
void add_quad(Mesh& mesh, uint32_t a, uint32_t b, uint32_t c, uint32_t d);

/// Axis-aligned box in the frame: 8 vertices, 12 triangles.
void add_box(Mesh& mesh, const DAffine& frame, DVec3 lo, DVec3 hi);
/// Box from lo to hi whose top is scaled by `taper` (1: not at all) about its centre.
void add_tapered_box(Mesh& mesh, const DAffine& frame, DVec3 lo, DVec3 hi, double taper);

/// Surface of revolution about the frame's y axis. Profile points are (radius, y) from bottom to top; radius 0 at an
/// end closes it there.
/// @param sides at least 3
void add_lathe(Mesh& mesh, const DAffine& frame, std::span<const glm::dvec2> profile, uint32_t sides);

/// Round bar along a path, closed at both ends with fans.
/// @param radii one per path point
void add_tube(Mesh& mesh, std::span<const DVec3> path, std::span<const double> radii, uint32_t sides);
void add_rod(Mesh& mesh, DVec3 from, DVec3 to, double radius, uint32_t sides);

/// Sphere of 6 * cells^2 quads. Each vertex is displacement(unit direction) * direction, transformed by the frame.
void add_blob(Mesh& mesh, const DAffine& frame, uint32_t cells, const std::function<double(DVec3)>& displacement);

/// A pointed leaf folded along its mid-rib: 4 vertices, 2 triangles.
/// @param direction from stalk to tip; its length is the leaf's length
/// @param side across the leaf; its length is half the leaf's width
void add_leaf(Mesh& mesh, DVec3 stalk, DVec3 direction, DVec3 side);

/// Adds quads over a common set of points to the flat parts of a model. Each part stores each point it uses once.
class PatchBuilder {
public:
  PatchBuilder(Model& model, std::span<const DVec3> points) : model_(model), points_(points) {}
  /// @param corners point numbers around the quad
  void quad(std::string_view material, const std::array<size_t, 4>& corners);

private:
  Model& model_;
  std::span<const DVec3> points_;
  std::map<const Mesh*, std::vector<uint32_t>> vertex_of_point_;
};

/// Computes area-weighted vertex normals from the triangles that share each vertex.
void compute_normals(Mesh& mesh);

} // namespace packtrace::scenegen
