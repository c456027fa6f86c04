#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "compress/bake/bake_scene.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace::test {

/// n x n quads over [0,1]^2 at z = 0, displaced in z by up to `bump`; optionally with normals of the displaced surface.
Mesh grid_mesh(uint32_t n, float bump = 0.0f, bool normals = false);

/// Latitude-longitude sphere around the origin with outward normals and winding, without collapsed triangles.
Mesh sphere_mesh(uint32_t rings, float radius = 1.0f);

/// Triangles in [-1,1]^3 without shared vertices. Deterministic.
Mesh soup_mesh(uint32_t triangles, uint32_t seed);

/// Returns the lexicographically smallest rotation of a triangle's corners, which does not depend on the first corner.
std::array<uint32_t, 3> rotated_to_smallest(const Triangle& t);

/// Uniform floats in [lo, hi), the same on every platform.
class Random {
public:
  explicit Random(uint32_t seed) : state_(seed * uint64_t{0x9e3779b97f4a7c15} + 1) {}
  uint32_t bits();
  float uniform(float lo, float hi);

private:
  uint64_t state_;
};

DAffine translation(DVec3 by);
DAffine scaling(DVec3 by);

/// Scene with the mesh as its only world shape.
Scene scene_of(Mesh mesh, const DAffine& world_from_mesh = DAffine(1.0));
void add_shape(Scene& scene, Mesh mesh, const DAffine& world_from_mesh = DAffine(1.0), uint32_t material = 0);

/// 64 x 32 texels in vertical stripes of four.
AlphaMask striped_mask();

/// Flat and smooth parts, a material with a mask and scaled texture coordinates, and two instances of an object with a
/// mirrored part.
Scene mixed_scene();

/// Rotates the corners so that the smallest is first; equal faces with equal winding become equal.
template <typename Corner>
std::array<Corner, 3> face_of(std::array<Corner, 3> corners) {
  std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
  return corners;
}

/// Bakes and discards diagnostics.
BakedScene bake(const Scene& scene, const BakeConfig& config = {});

/// All clusters of a geometry, decoded one after another.
struct Decoded {
  std::vector<Vec3> positions;
  std::vector<Vec3> normals; ///< zero for clusters without normals
  std::vector<Vec2> uvs;     ///< zero for clusters without texture coordinates
  std::vector<Triangle> triangles;
  std::vector<uint32_t> slots; ///< material slot per triangle
};
Decoded decode(const BakedFile& file, uint32_t geometry);

} // namespace packtrace::test
