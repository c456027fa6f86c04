#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pbrt_import/scene/scene.h"

namespace packtrace::test {

/// A mesh of a class that simplifiers find hard, or of the smooth bodies that they are made for.
struct ClassMesh {
  std::string name;
  std::string of_class; ///< mechanical, plate, strands, sponge, open, organic
  Mesh (*make)();
};

/// Meshes of all classes. Closed except for those of class "open"; vertices are shared, without normals.
std::vector<ClassMesh> class_meshes();

/// A closed plate of 1 x 0.7 in cells x cells squares on each side, whose middle surface is bent upwards by `bend`.
Mesh plate_mesh(uint32_t cells, double thickness, double bend);

/// Closed strands of equal radius that grow from the unit square and curl.
Mesh strands_mesh(uint32_t count, uint32_t steps, uint32_t sides, double radius, uint32_t seed);

/// Open fins of two thin sides, which taper to a point, bend and cross each other.
Mesh fins_mesh(uint32_t count, uint32_t steps, uint32_t seed);

/// A Menger sponge of 20^depth cubes. Each square of its surface is two triangles.
Mesh sponge_mesh(uint32_t depth);

} // namespace packtrace::test
