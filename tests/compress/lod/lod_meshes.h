#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "compress/bake/lod/cluster_lod.h"
#include "compress/format/file/baked_file.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace::test {

/// A closed torus without normals, all vertices shared.
Mesh torus_mesh(uint32_t around, uint32_t across);

/// Gives every second triangle of the mesh its own corners with its own normals, so that there are seams everywhere.
Mesh half_faceted(const Mesh& mesh);

/// Closed tetrahedra at random positions in [-1,1]^3.
Mesh tetrahedra_mesh(uint32_t count, uint32_t seed);

/// A flat square of 12 x 12 cells whose four outer corners are cut off by `cut` of a cell. Collapsing both points of
/// such a corner costs almost nothing and leaves a small part of a large triangle sticking out.
Mesh chamfered_sheet(float cut);

/// The mesh with every triangle doubled, facing the same or the other side.
Mesh twice(Mesh mesh, bool other_side);

/// A mesh that the LOD builder must handle.
struct NamedMesh {
  std::string name;
  Mesh (*make)();
  bool closed = false;
};
/// For gtest messages.
inline void PrintTo(const NamedMesh& mesh, std::ostream* out) { *out << mesh.name; }
std::vector<NamedMesh> stress_meshes();
std::vector<NamedMesh> closed_stress_meshes();
/// Converts a mesh name to a test name.
std::string identifier(std::string name);

/// Gives LOD levels to all geometries of at least `min_triangles` triangles that `use` selects.
BakeConfig config_with_levels(LodUse use = LodUse::kAll, uint32_t min_triangles = 1);

/// Two materials of different classes, one with texture coordinates, and normals; each mesh is placed twice.
Scene mixed_lod_scene();

/// A quantised mesh with its clusters and LOD levels.
struct BuiltLod {
  QuantizedGeometry geometry;
  GeometryClusters base;
  ClusterLod lod;
};
BuiltLod build_lod(const Mesh& mesh);
/// The same of a stress mesh, built once per program.
const BuiltLod& built_lod(const NamedMesh& mesh);

/// Reads levels from a file in the builder's form: decoded lattice points; errors and spheres as stored, in object
/// units.
ClusterLod read_lod(const BakedFile& file, uint32_t geometry);

/// 0, every error of a group, and the adjacent values on both sides of it. Ascending.
std::vector<double> thresholds(const ClusterLod& lod);

/// Number of triangles of a discrete level: its clusters and those of terminal groups below it.
uint64_t level_triangles(const ClusterLod& lod, uint32_t level);

/// The clusters of the cut that allows errors up to `threshold`.
std::vector<uint32_t> cut_clusters(const ClusterLod& lod, double threshold);

/// Directed edges that occur more often than their opposites, by lattice point; only those with a nonzero count. Empty
/// for closed surfaces.
struct BoundaryEdge {
  LatticePoint a, b; ///< a < b
  int64_t count;     ///< of a -> b minus that of b -> a
  bool operator==(const BoundaryEdge&) const = default;
};
std::vector<BoundaryEdge> boundary(const ClusterLod& lod, const std::vector<uint32_t>& clusters);

} // namespace packtrace::test
